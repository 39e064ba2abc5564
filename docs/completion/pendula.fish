# fish completion for pendula.
complete -c pendula -f
complete -c pendula -s e -x -d 'Run code'
complete -c pendula -s i -d 'Go on with an interactive session'
complete -c pendula -l no-color -d 'No colour'
complete -c pendula -s v -l version -d 'Print the version'
complete -c pendula -l licences -d 'Print the licences of its parts'
complete -c pendula -s h -l help -d 'Print a summary of the options'
complete -c pendula -n '__fish_is_first_arg' -a test -d 'Run scripted tests'
complete -c pendula -n '__fish_is_first_arg' -a report -d 'Write a script as a page'
complete -c pendula -n '__fish_is_first_arg' -a manual -d 'Open the manual'
complete -c pendula -n '__fish_is_first_arg' -a kernel -d 'Make the notebook kernel known to Jupyter'
complete -c pendula -k -a '(__fish_complete_suffix .lua)'
