#compdef pidcfg
# Completion of pidcfg for zsh.
_pidcfg() {
    local -a plain described paths folders parts response
    local type value descr
    response=("${(@f)$(env COMP_WORDS="${(j: :)words[1,CURRENT-1]} $QIPREFIX$PREFIX" _PIDCFG_COMPLETE=zsh_complete \
        ${(Q)words[1]} 2>/dev/null)}")
    for type value descr in $response; do
        case $type in
            folder) folders+=("$value") ;;
            path) paths+=("$value") ;;
            part) parts+=("$value") ;;
            plain) if [[ $descr == _ ]]; then plain+=("$value"); else described+=("$value:$descr"); fi ;;
        esac
    done
    (( $#described )) && _describe -V pidcfg described -U
    (( $#plain )) && compadd -U -V plain -a plain
    (( $#paths )) && compadd -U -V paths -a paths
    (( $#folders )) && compadd -U -V folders -S '' -a folders
    (( $#parts )) && compadd -U -V parts -S '' -a parts
    return 0
}

if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    _pidcfg "$@"
else
    compdef _pidcfg pidcfg
fi
