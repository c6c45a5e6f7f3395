# COMP_WORDS would split sim:mh4@5 and ai-input-pv:1.
_cangauge() {
    local -a line
    local text="${COMP_LINE:0:COMP_POINT}" word name
    read -ra line <<< "$text"
    [[ "$text" == *[[:space:]] ]] && line+=("")
    word="${line[${#line[@]} - 1]}"
    COMPREPLY=()
    while IFS=$'\t' read -r name _; do
        COMPREPLY+=("${name#"${word%"${word##*[:=@]}"}"}")
    done < <(cangauge completions -- "${line[@]:1}" 2>/dev/null)
}

complete -F _cangauge -o bashdefault -o default cangauge
