// The libraries that the program is linked with, and their licences.
#pragma once

#include <string>

namespace pendula::lua {

/// The text of --licences: one paragraph for each library of this build, whose names come from CMake.
std::string licences_text();

}  // namespace pendula::lua
