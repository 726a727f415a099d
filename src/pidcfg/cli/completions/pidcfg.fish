# Completion of pidcfg for fish.
function __pidcfg_complete
    set -l line (commandline --cut-at-cursor --current-process | string collect)
    for item in (env COMP_WORDS="$line" _PIDCFG_COMPLETE=fish_complete pidcfg 2>/dev/null)
        string split --max 1 --fields 2 -- "," $item
    end
end

complete --command pidcfg --no-files --keep-order --arguments "(__pidcfg_complete)"
