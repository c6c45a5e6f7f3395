function __cangauge
    set -l word (commandline -ct)
    set -l found (cangauge completions -- (commandline -opc)[2..-1] $word 2>/dev/null)
    if set -q found[1]
        string join \n -- $found
    else
        __fish_complete_path $word
    end
end

complete -c cangauge -f -a '(__cangauge)'
