// Text of strangers where people read it: what a terminal would obey, or a reader could not see, is written
// as Lua would ("\27[2J", "\u{202E}").
#pragma once

#include <string>
#include <string_view>

namespace pendula::shell::sandbox {

/// The number of a well-formed UTF-8 character.
unsigned code_of(std::string_view character);
/// Control characters but for line ends and tabs, and marks that turn the direction of writing.
bool is_obeyed(unsigned code);

/// Text that comes in pieces. What a terminal would obey and bytes that are no UTF-8 are
/// spelled out.
class ControlFilter {
 public:
  std::string operator()(std::string_view piece);
  /// At the end: what may have been the beginning of a character.
  std::string rest();

 private:
  std::string kept_;
};

std::string harmless(std::string_view text);
/// As part of a report: its further lines begin with a bar, so that none of them
/// looks like a line of the report.
std::string harmless_part(std::string_view text);

}  // namespace pendula::shell::sandbox
