# bash completion for pendula: options, then Lua files; everything behind the script is the script's.
_pendula() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} i
  compopt -o filenames
  COMPREPLY=()
  [[ $previous == -e && $COMP_CWORD -gt 1 ]] && return
  for ((i = 1; i < COMP_CWORD; i++)); do
    case ${COMP_WORDS[i]} in
      report) mapfile -t COMPREPLY < <(compgen -f -- "$word"; compgen -W '-o --timing --fold --help' -- "$word"); return ;;
      kernel) mapfile -t COMPREPLY < <(compgen -W 'install uninstall --prefix --help' -- "$word"); return ;;
      manual) mapfile -t COMPREPLY < <(compgen -f -- "$word"; compgen -W '-o --luals --help' -- "$word"); return ;;
      test) mapfile -t COMPREPLY < <(compgen -f -X '!*.lua' -- "$word"; compgen -d -- "$word"); return ;;
      -e | --time | --memory | --folder) ((i++)) ;;
      -?*) ;;
      *) mapfile -t COMPREPLY < <(compgen -f -- "$word"); return ;;
    esac
  done
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W '-e -i - -- --safe --time --memory --folder --json --no-color --version --licences --help' -- "$word")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -f -X '!*.lua' -- "$word"; compgen -d -- "$word"; compgen -W 'test report manual kernel' -- "$word")
}
complete -F _pendula pendula
