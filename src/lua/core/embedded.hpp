// The stdlib folder inside the program: Lua as bytecode, other files as they are. The definition is generated
// by cmake/embed.cpp at build time.
#pragma once

#include <cstddef>
#include <vector>

namespace pendula::lua {

struct EmbeddedFile {
  const char* name;  ///< path below stdlib/, e.g. "tableaus/init.lua"
  const unsigned char* bytes;
  size_t size;
};

/// Sorted by name.
const std::vector<EmbeddedFile>& embedded_stdlib();

}  // namespace pendula::lua
