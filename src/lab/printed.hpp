// Numbers in the columns of an iteration.
#pragma once

#include <string>

namespace pendula::lab {

/// The value by a format of printf with a precision, "%.*e" or "%.*f"; never -0.000.
std::string printed(const char* format, int digits, double value);

}  // namespace pendula::lab
