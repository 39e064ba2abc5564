# ./dev package: a Debian package, whose dependencies dpkg-shlibdeps finds, and an archive that runs from any folder because it
# brings its libraries (PENDULA_BUNDLE).
option(PENDULA_BUNDLE "install the shared libraries beside the program, which then finds them wherever it is put" OFF)
if(PENDULA_BUNDLE)
  set_target_properties(pendula PROPERTIES INSTALL_RPATH "$ORIGIN/../lib/pendula")
  # What every Linux system has stays outside: glibc, the loader.
  install(TARGETS pendula RUNTIME_DEPENDENCY_SET libraries COMPONENT program)
  install(RUNTIME_DEPENDENCY_SET libraries
          PRE_EXCLUDE_REGEXES "^lib(c|m|dl|rt|pthread)\\.so" "^ld-linux"
          DESTINATION lib/pendula COMPONENT program)
else()
  install(TARGETS pendula COMPONENT program)
endif()

set(documents ${CMAKE_BINARY_DIR}/documents)
file(MAKE_DIRECTORY ${documents})
add_custom_command(
  OUTPUT ${documents}/copyright ${documents}/changelog.gz ${documents}/NEWS.gz ${documents}/pendula.1.gz
  COMMAND ${CMAKE_SOURCE_DIR}/cmake/documents.sh $<TARGET_FILE:pendula> ${CMAKE_SOURCE_DIR} ${documents} ${PROJECT_VERSION}
  DEPENDS pendula ${CMAKE_SOURCE_DIR}/cmake/documents.sh ${CMAKE_SOURCE_DIR}/CHANGELOG.md ${CMAKE_SOURCE_DIR}/docs/pendula.1
  VERBATIM)
add_custom_target(pendula_package DEPENDS pendula ${documents}/copyright)
install(FILES ${documents}/copyright ${documents}/changelog.gz ${documents}/NEWS.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/pendula COMPONENT program OPTIONAL)
install(FILES ${documents}/pendula.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program OPTIONAL)

set(CPACK_COMPONENTS_ALL program)
if(TARGET pendula-kernel AND NOT PENDULA_BUNDLE)  # a package of its own: xeus brings libraries that nobody else needs
  list(APPEND CPACK_COMPONENTS_ALL kernel)
  add_dependencies(pendula_package pendula-kernel)
  install(TARGETS pendula-kernel COMPONENT kernel)
  install(FILES cmake/kernel.json DESTINATION ${CMAKE_INSTALL_DATADIR}/jupyter/kernels/pendula COMPONENT kernel)
  install(FILES ${documents}/copyright ${documents}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/pendula-kernel
          COMPONENT kernel OPTIONAL)
endif()

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
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME pendula)
# libflint.so.17, opened at run time and thus unknown to shlibdeps, is in the package libflint17.
string(REPLACE ".so." "" opened "gnuplot-nox;${flint};${matio}")
list(REMOVE_ITEM opened "")
list(JOIN opened ", " opened)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "${opened}")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "chromium, xdg-utils, pendula-kernel")
set(CPACK_DEBIAN_KERNEL_PACKAGE_NAME pendula-kernel)
set(CPACK_DEBIAN_KERNEL_PACKAGE_DEPENDS "pendula (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_KERNEL_PACKAGE_RECOMMENDS "gnuplot-nox, jupyter-notebook | jupyter-console")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
set(CPACK_DEBIAN_KERNEL_DESCRIPTION "Pendula in Jupyter notebooks")
set(CPACK_COMPONENT_KERNEL_DESCRIPTION "The kernel by which Jupyter notebooks run Pendula:
text, formulas, tables, figures and animations, completion and
inspection as at the prompt.")
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
    WORLD_EXECUTE)
include(CPack)
