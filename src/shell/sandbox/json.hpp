// Writing JSON: reports for other programs.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pendula::shell::sandbox {

/// "text" in quotes; bytes that are no UTF-8 become U+FFFD.
std::string json_text(std::string_view bytes);
/// 0.25, 3; null unless finite.
std::string json_number(double value);
/// ["a", "b"]; the entries are JSON already.
std::string json_list(const std::vector<std::string>& entries);
/// {"key": value, …}; the values are JSON already.
std::string json_object(const std::vector<std::pair<std::string, std::string>>& entries);

}  // namespace pendula::shell::sandbox
