# ./dev package: a Debian package, whose dependencies dpkg-shlibdeps finds, and an archive that runs from any folder because it
# brings its libraries (PENDULA_BUNDLE).
option(PENDULA_BUNDLE "install the shared libraries beside the program, which then finds them wherever it is put" OFF)
if(PENDULA_BUNDLE)
  set_target_properties(pendula PROPERTIES INSTALL_RPATH "$ORIGIN/../lib/pendula")
  # What every Linux system has stays outside: glibc, the loader.
  install(TARGETS pendula RUNTIME_DEPENDENCY_SET libraries)
  install(RUNTIME_DEPENDENCY_SET libraries
          PRE_EXCLUDE_REGEXES "^lib(c|m|dl|rt|pthread)\\.so" "^ld-linux"
          DESTINATION lib/pendula)
else()
  install(TARGETS pendula)
endif()

set(documents ${CMAKE_BINARY_DIR}/documents)
file(MAKE_DIRECTORY ${documents})
add_custom_command(
  OUTPUT ${documents}/copyright ${documents}/changelog.gz ${documents}/NEWS.gz ${documents}/pendula.1.gz
  COMMAND ${CMAKE_SOURCE_DIR}/cmake/documents.sh $<TARGET_FILE:pendula> ${CMAKE_SOURCE_DIR} ${documents} ${PROJECT_VERSION}
  DEPENDS pendula ${CMAKE_SOURCE_DIR}/cmake/documents.sh ${CMAKE_SOURCE_DIR}/CHANGELOG.md ${CMAKE_SOURCE_DIR}/docs/pendula.1
  VERBATIM)
add_custom_target(pendula_documents DEPENDS ${documents}/copyright)
install(FILES ${documents}/copyright ${documents}/changelog.gz ${documents}/NEWS.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/pendula OPTIONAL)
install(FILES ${documents}/pendula.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)

set(CPACK_PACKAGE_NAME pendula)
set(CPACK_PACKAGE_CONTACT "The Pendula maintainers <maintainers@pendula.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Lua for dynamic systems: models, index, simulation, identification")
set(CPACK_PACKAGE_DESCRIPTION
    "An interactive shell and script interpreter for dynamic systems:
variables, Lagrangians and differential-algebraic equations, their
index and reduction, consistent initial values, integration, figures,
reports, and parameters from data.")
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/package)
set(CPACK_PACKAGE_FILE_NAME pendula-${PROJECT_VERSION}-linux-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION math)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libmatio11, chromium, xdg-utils")
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
    WORLD_EXECUTE)
include(CPack)
