# Completion of pidcfg for Windows PowerShell 5.1 and PowerShell 7.
Register-ArgumentCompleter -Native -CommandName pidcfg -ScriptBlock {
    param($wordToComplete, $commandAst, $cursorPosition)

    $line = $commandAst.Extent.Text
    $length = [Math]::Max(0, $cursorPosition - $commandAst.Extent.StartOffset)
    $line = $line.PadRight($length).Substring(0, $length)
    $before = $env:COMP_WORDS, $env:_PIDCFG_COMPLETE
    $env:COMP_WORDS = $line
    $env:_PIDCFG_COMPLETE = 'powershell_complete'
    try {
        $response = @(& pidcfg 2>$null)
    } finally {
        $env:COMP_WORDS, $env:_PIDCFG_COMPLETE = $before
    }
    for ($i = 0; $i + 2 -lt $response.Count; $i += 3) {
        $value, $tip = $response[$i + 1], $response[$i + 2]
        if ($tip -eq '_') { $tip = $value }
        $kind = switch ($response[$i]) {
            'folder' { 'ProviderContainer' }
            'path' { 'ProviderItem' }
            default { 'ParameterValue' }
        }
        [System.Management.Automation.CompletionResult]::new($value, $value, $kind, $tip)
    }
}
