# stdlib/**/*.lua → bytecode in pendula_lua, and the other files of stdlib/document as they are. The tool links the same Lua
# that will run the chunks.
add_executable(pendula_embed ${CMAKE_SOURCE_DIR}/cmake/embed.cpp)
target_link_libraries(pendula_embed PRIVATE PkgConfig::LUA)
set_target_properties(pendula_embed PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tools)

file(GLOB_RECURSE stdlib_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/stdlib/*.lua ${CMAKE_SOURCE_DIR}/stdlib/*.css
     ${CMAKE_SOURCE_DIR}/stdlib/*.js ${CMAKE_SOURCE_DIR}/stdlib/*.woff2)
set(embedded ${CMAKE_BINARY_DIR}/embedded_stdlib.cpp)
add_custom_command(
  OUTPUT ${embedded}
  COMMAND pendula_embed ${embedded} ${CMAKE_SOURCE_DIR}/stdlib ${stdlib_files}
  DEPENDS pendula_embed ${stdlib_files}
  COMMENT "Compiling the Lua stdlib"
  VERBATIM)
target_sources(pendula_lua PRIVATE ${embedded})
