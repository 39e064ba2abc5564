// Words and columns: what every module needs to speak to a person in a terminal.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pendula {

/// Number of terminal columns of a UTF-8 text (combining marks count 0, every other code point 1).
int display_width(std::string_view utf8);

/// Shortest decimal text that reads back as the same double ("0.1", "1e-09", "inf", "nan").
std::string shortest(double value);

/// At most `digits` significant digits, trailing zeros dropped; the way numbers are shown in tables.
std::string rounded(double value, int digits = 10);

/// The candidate nearest to `word` (Damerau-Levenshtein, at most a third of its letters wrong), or "".
std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// " Did you mean 'x'?" or "".
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

/// Splits at white space and commas: "x, y" -> {"x", "y"}.
std::vector<std::string> split_words(std::string_view words);

std::string join(const std::vector<std::string>& parts, std::string_view separator);

/// x₁₂ from "x12": trailing digits as Unicode subscripts; superscript(-2) is "⁻²".
std::string subscript(long value);
std::string superscript(long value);

/// Aligned columns, two blanks apart, no trailing blanks. Rows may differ in length.
/// `right[j]`: column j is right-aligned.
class Table {
 public:
  explicit Table(std::vector<bool> right = {}) : right_(std::move(right)) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// A horizontal rule as wide as the table.
  void rule() { rows_.push_back({}); }
  /// Every line is indented by `indent` blanks and ends in a newline.
  std::string str(int indent = 0) const;

 private:
  std::vector<std::vector<std::string>> rows_;
  std::vector<bool> right_;
};

}  // namespace pendula
