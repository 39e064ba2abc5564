# stdlib/**/*.lua → bytecode in pendula_lua; the other files of stdlib/document and the pages of the manual as they are. The
# tool links the same Lua that will run the chunks.
add_executable(pendula_embed ${CMAKE_SOURCE_DIR}/cmake/embed.cpp)
target_link_libraries(pendula_embed PRIVATE PkgConfig::LUA)
set_target_properties(pendula_embed PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tools)

file(GLOB_RECURSE stdlib_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/stdlib/*.lua ${CMAKE_SOURCE_DIR}/stdlib/*.css
     ${CMAKE_SOURCE_DIR}/stdlib/*.js ${CMAKE_SOURCE_DIR}/stdlib/*.woff2 ${CMAKE_SOURCE_DIR}/docs/manual/*.md)
list(APPEND stdlib_files ${CMAKE_SOURCE_DIR}/docs/language.md ${CMAKE_SOURCE_DIR}/docs/glossary.md
     ${CMAKE_SOURCE_DIR}/docs/derivations.md)
set(embedded ${CMAKE_BINARY_DIR}/embedded_stdlib.cpp)
add_custom_command(
  OUTPUT ${embedded}
  COMMAND pendula_embed ${embedded} ${CMAKE_SOURCE_DIR} ${stdlib_files}
  DEPENDS pendula_embed ${stdlib_files}
  COMMENT "Compiling the Lua stdlib"
  VERBATIM)
set_source_files_properties(${embedded} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
target_sources(pendula_lua PRIVATE ${embedded})
