#include "base/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace pendula {
namespace {

bool is_combining(char32_t c) { return (c >= 0x0300 && c <= 0x036F) || (c >= 0x20D0 && c <= 0x20FF); }

char32_t next_code_point(std::string_view s, size_t& i) {
  const auto lead = static_cast<unsigned char>(s[i++]);
  const int more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : 0;
  char32_t c = more ? lead & (0x3F >> more) : lead;
  for (int k = 0; k < more && i < s.size(); ++k) c = (c << 6) | (static_cast<unsigned char>(s[i++]) & 0x3F);
  return c;
}

/// Damerau-Levenshtein distance (optimal string alignment).
int distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i)
    for (size_t j = 1; j <= b.size(); ++j) {
      const int wrong = a[i - 1] != b[j - 1];
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + wrong});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::string digits_as(long value, const char* const glyphs[10], const char* minus) {
  std::string out;
  for (char c : std::to_string(value)) out += c == '-' ? minus : glyphs[c - '0'];
  return out;
}

}  // namespace

int display_width(std::string_view s) {
  int width = 0;
  for (size_t i = 0; i < s.size();) width += is_combining(next_code_point(s, i)) ? 0 : 1;
  return width;
}

std::string shortest(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end.ptr};
}

std::string rounded(double value, int digits) {
  if (!std::isfinite(value)) return shortest(value);
  if (value == 0) return "0";  // never "-0"
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  return buffer;
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string* best = nullptr;
  if (word.size() < 2) return "";  // any letter is equally near
  int best_distance = std::max<int>(1, static_cast<int>(word.size()) / 3) + 1;
  for (const auto& candidate : candidates) {
    const auto gap = static_cast<long>(candidate.size()) - static_cast<long>(word.size());
    if (std::labs(gap) >= best_distance || candidate == word) continue;
    if (const int d = distance(word, candidate); d < best_distance) {
      best_distance = d;
      best = &candidate;
    }
  }
  return best ? *best : "";
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string best = nearest_word(word, candidates);
  return best.empty() ? "" : " Did you mean '" + best + "'?";
}

std::vector<std::string> split_words(std::string_view words) {
  std::vector<std::string> out;
  std::string current;
  for (char c : words) {
    if (c == ' ' || c == ',' || c == '\t' || c == '\n') {
      if (!current.empty()) {
        out.push_back(std::move(current));
        current.clear();
      }
    } else {
      current += c;
    }
  }
  if (!current.empty()) out.push_back(std::move(current));
  return out;
}

std::string join(const std::vector<std::string>& parts, std::string_view separator) {
  std::string out;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i) out += separator;
    out += parts[i];
  }
  return out;
}

std::string subscript(long value) {
  static const char* const glyphs[] = {"₀", "₁", "₂", "₃", "₄", "₅", "₆", "₇", "₈", "₉"};
  return digits_as(value, glyphs, "₋");
}

std::string superscript(long value) {
  static const char* const glyphs[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  return digits_as(value, glyphs, "⁻");
}

std::string Table::str(int indent) const {
  std::vector<int> width;
  for (const auto& row : rows_)
    for (size_t j = 0; j < row.size(); ++j) {
      if (j >= width.size()) width.push_back(0);
      width[j] = std::max(width[j], display_width(row[j]));
    }
  int total = width.empty() ? 0 : -2;
  for (int w : width) total += w + 2;
  std::string out;
  for (const auto& row : rows_) {
    std::string line(indent, ' ');
    if (row.empty())
      for (int k = 0; k < total; ++k) line += "─";
    for (size_t j = 0; j < row.size(); ++j) {
      const std::string pad(width[j] - display_width(row[j]), ' ');
      const bool right = j < right_.size() && right_[j];
      line += (j ? "  " : "") + (right ? pad + row[j] : row[j] + pad);
    }
    while (!line.empty() && line.back() == ' ') line.pop_back();
    out += line + "\n";
  }
  return out;
}

}  // namespace pendula
