# cmake --install: the program (its stdlib is inside), the man page, the completion of three shells.
include(GNUInstallDirs)
install(TARGETS pendula)
install(FILES docs/pendula.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES docs/completion/pendula.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME pendula)
install(FILES docs/completion/_pendula DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
install(FILES docs/completion/pendula.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
