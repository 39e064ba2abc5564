// Properties of the terminal that the program runs in.
#pragma once

#include <string>
#include <string_view>

namespace pendula::shell {

bool is_terminal(int fd);

/// Colour is for people: the descriptor is a terminal that is not dumb, and NO_COLOR (https://no-color.org)
/// is unset or empty.
bool has_colour(int fd);

/// From now on nothing in this process, and no process it starts, writes colour (the option --no-color).
void refuse_colour();

/// The text in red if `fd` shows colour, else the text.
std::string red(std::string_view text, int fd);

/// Letters outside ASCII count as one column each. The locale of the user decides; one that is not UTF-8 is
/// replaced, since what we print is UTF-8. Numbers keep the decimal point.
void use_utf8();

}  // namespace pendula::shell
