# cmake --install: the program (its stdlib is inside), the completion of three shells; the man page and what packages need
# comes from package.cmake.
include(GNUInstallDirs)
install(FILES docs/completion/pendula.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME pendula COMPONENT program)
install(FILES docs/completion/_pendula DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT program)
install(FILES docs/completion/pendula.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
include(cmake/package.cmake)
