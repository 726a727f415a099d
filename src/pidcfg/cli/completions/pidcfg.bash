# Completion of pidcfg for bash 4.4 and newer.
_pidcfg() {
    local item type value typed=${COMP_WORDS[COMP_CWORD]}
    COMPREPLY=()
    while IFS= read -r item; do
        type=${item%%,*}
        value=${item#*,}
        case $type in
            folder) compopt -o nospace -o filenames ;;
            path) compopt -o filenames ;;
            part) compopt -o nospace ;;
        esac
        # bash quotes the names of files only; nothing else may reach the line so that it would be run or split.
        if [[ $type != folder && $type != path && $value == *[!A-Za-z0-9_./=,:+@%-]* ]]; then
            case $typed in
                [\"\']*) [[ $value == *[\"\'\`\$\!\\]* ]] && continue ;;
                *) printf -v value %q "$value" ;;
            esac
        fi
        COMPREPLY+=("$value")
    done < <(env COMP_WORDS="${COMP_LINE:0:COMP_POINT}" _PIDCFG_COMPLETE=bash_complete "${1/#\~/$HOME}" 2>/dev/null)
}

if ((BASH_VERSINFO[0] * 100 + BASH_VERSINFO[1] < 404)); then
    echo "pidcfg: completion needs bash 4.4 or newer; this is $BASH_VERSION" >&2
else
    complete -o nosort -F _pidcfg pidcfg
fi
