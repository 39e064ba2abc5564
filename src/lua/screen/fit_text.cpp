#include "lua/screen/fit_text.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/text.hpp"

namespace pendula::lua {
namespace {

/// One character of a line with its column.
struct Glyph {
  std::string_view bytes;
  int width;
};
using Line = std::vector<Glyph>;

Line glyphs(std::string_view line) {
  Line list;
  while (!line.empty()) {
    std::size_t size = 1;
    while (size < line.size() && (static_cast<unsigned char>(line[size]) & 0xC0) == 0x80) ++size;
    list.push_back({line.substr(0, size), display_width(line.substr(0, size))});
    line.remove_prefix(size);
  }
  return list;
}

int width_of(const Line& line) {
  int width = 0;
  for (const Glyph& g : line) width += g.width;
  return width;
}

std::string joined(const Line& line, std::size_t from, std::size_t to) {
  std::string out;
  for (std::size_t i = from; i < std::min(to, line.size()); ++i) out += line[i].bytes;
  return out.substr(0, out.find_last_not_of(' ') + 1);
}

bool is_blank(const Line& line, std::size_t i) { return line[i].bytes == " "; }

// ── one line ──

/// The column at which continuation lines begin: after the last run of at least two blanks in the first half,
/// else four columns further in than the line itself.
std::size_t hanging_indent(const Line& line, int columns) {
  std::size_t first = 0;
  while (first < line.size() && is_blank(line, first)) ++first;
  std::size_t indent = first + 4;
  for (std::size_t i = first; i + 2 < line.size() && i < static_cast<std::size_t>(columns) / 2; ++i)
    if (is_blank(line, i) && is_blank(line, i + 1) && !is_blank(line, i + 2)) indent = i + 2;
  return std::min(indent, static_cast<std::size_t>(columns) / 2);
}

int bracket(std::string_view glyph) {
  if (glyph == "(" || glyph == "[" || glyph == "{") return 1;
  if (glyph == ")" || glyph == "]" || glyph == "}") return -1;
  return 0;
}

bool is_operator(const Line& line, std::size_t blank) {
  if (blank + 2 >= line.size() || line[blank + 2].bytes != " ") return false;
  const std::string_view glyph = line[blank + 1].bytes;
  return glyph == "=" || glyph == "+" || glyph == "-" || glyph == "~" || glyph == "−";
}

bool is_letter(std::string_view glyph) {
  return glyph.size() == 1 && (glyph[0] | 0x20) >= 'a' && (glyph[0] | 0x20) <= 'z';
}

/// The kind of a line: a sentence may contain x = 1, an equation sin and cos.
enum class Reading { words, formula };

/// A formula has operators, and less than two words of three letters (function names excluded) per operator.
Reading reading_of(const Line& line) {
  int operators = 0, words = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    operators += is_blank(line, i) && is_operator(line, i);
    std::size_t end = i;
    while (end < line.size() && is_letter(line[end].bytes)) ++end;
    if (end == i) continue;
    const bool function = end < line.size() && line[end].bytes == "(";
    words += end - i >= 3 && !function;
    i = end - 1;
  }
  return operators > 0 && words < 2 * operators ? Reading::formula : Reading::words;
}

/// The best blank in (from, to) for a line break: late, outside brackets, before an operator of a formula but
/// not next to one in a sentence; `to` if there is none.
std::size_t best_break(const Line& line, std::size_t from, std::size_t to, Reading reading) {
  // columns by which a break may come earlier to avoid these
  constexpr int per_depth = 12, inside_product = 25;
  std::size_t best = to;
  int least = 0, depth = 0;
  for (std::size_t i = from; i < to; ++i) {
    depth = std::max(0, depth + bracket(line[i].bytes));
    if (!is_blank(line, i) || i == from) continue;
    const bool after_comma = line[i - 1].bytes == ",";
    const bool before = is_operator(line, i), behind = i > 1 && is_operator(line, i - 2);
    const bool torn = reading == Reading::formula ? !before && !after_comma : before || behind;
    const int cost = static_cast<int>(to - i) + per_depth * depth + (torn ? inside_product : 0);
    if (best == to || cost <= least) {
      best = i;
      least = cost;
    }
  }
  return best;
}

std::string folded(const Line& line, int columns) {
  if (width_of(line) <= columns) return joined(line, 0, line.size());
  const Reading reading = reading_of(line);
  const std::size_t indent = hanging_indent(line, columns);
  std::string out;
  std::size_t from = 0;
  while (from < line.size()) {
    const int room = columns - (from == 0 ? 0 : static_cast<int>(indent));
    std::size_t to = from;
    int used = 0;
    while (to < line.size() && used + line[to].width <= room) used += line[to++].width;
    std::size_t first_word = from;
    while (first_word < to && is_blank(line, first_word)) ++first_word;
    if (to < line.size() && !is_blank(line, to)) {
      const std::size_t at = best_break(line, first_word, to, reading);
      if (at < to) {
        to = at;
      } else {  // a single word is not broken
        while (to < line.size() && !is_blank(line, to)) ++to;
      }
    } else if (to < line.size() && (reading == Reading::formula) != is_operator(line, to)) {
      to = best_break(line, first_word, to + 1, reading);
    }
    if (!out.empty()) out += "\n" + std::string(indent, ' ');
    out += joined(line, from, to);
    from = to;
    while (from < line.size() && is_blank(line, from)) ++from;
  }
  return out;
}

// ── several lines: matrices and tables of numbers ──

/// A line "────┼────" of a table.
bool is_rule(const Line& line) {
  const auto first =
      std::find_if(line.begin(), line.end(), [](const auto& glyph) { return glyph.bytes != " "; });
  return first != line.end() && first->bytes == "─";
}

/// Columns of a group of lines: cells [begin, end), separated by blanks common to all lines except rules.
struct Segment {
  std::size_t begin, end;
};

std::vector<Segment> segments(const std::vector<Line>& lines) {
  std::size_t longest = 0;
  for (const Line& line : lines) longest = std::max(longest, line.size());
  std::vector<Segment> list;
  bool inside = false;
  for (std::size_t i = 0; i < longest; ++i) {
    const bool blank = std::all_of(lines.begin(), lines.end(), [&](const Line& line) {
      return i >= line.size() || is_blank(line, i) || (is_rule(line) && line[i].bytes == "─");
    });
    if (!blank && !inside) list.push_back({i, i});
    inside = !blank;
    if (inside) list.back().end = i + 1;
  }
  return list;
}

/// The first columns that fit next to the last one, with ⋯ in between; "" if there are too few columns.
std::string elided(const std::vector<Line>& lines, int columns) {
  const std::vector<Segment> all = segments(lines);
  constexpr std::size_t fewest = 4;
  if (all.size() < fewest) return "";
  const Segment last = all.back();
  const std::size_t room = static_cast<std::size_t>(std::max(columns, 20)) - (last.end - last.begin) - 4;
  std::size_t kept = 0;
  while (kept + 1 < all.size() && all[kept].end <= room) ++kept;
  if (kept == 0) return "";
  std::string out;
  for (std::size_t row = 0; row < lines.size(); ++row) {
    Line line = lines[row];
    const std::size_t cut = all[kept - 1].end;
    const bool rule = is_rule(line);
    while (line.size() < last.end) line.push_back({rule ? "─" : " ", 1});
    std::string left;
    for (std::size_t i = 0; i < cut; ++i) left += line[i].bytes;
    out += (row ? "\n" : "") + left + (rule ? "────" : " ⋯  ") + joined(line, last.begin, last.end);
  }
  return out;
}

bool contains(std::string_view line, const char* what) { return line.find(what) != line.npos; }

/// A line of a table with a rule: a tableau, a state space.
bool is_ruled(std::string_view line) {
  return contains(line, "│") || contains(line, "─┼─") || contains(line, "─┴─");
}

/// The number of lines from `at` that form one matrix or one table of columns; 1 for an independent line.
std::size_t group_size(const std::vector<std::string_view>& lines, std::size_t at, int columns) {
  std::size_t end = at;
  if (contains(lines[at], "⎡")) {
    while (end < lines.size() && !contains(lines[end], "⎣")) ++end;
    return std::min(end + 1, lines.size()) - at;
  }
  while (end < lines.size() && is_ruled(lines[end])) ++end;
  if (end > at) return end - at;
  while (end < lines.size() && display_width(lines[end]) > columns) ++end;
  return std::max<std::size_t>(end - at, 1);
}

/// Do these rows contain numbers? Lines of words are wrapped instead of cut.
bool is_numeric(const std::vector<std::string_view>& lines, std::size_t at, std::size_t n) {
  std::size_t letters = 0, digits = 0;
  for (std::size_t i = at; i < at + n; ++i)
    for (unsigned char c : lines[i]) {
      letters += (c | 0x20) >= 'a' && (c | 0x20) <= 'z';
      digits += c >= '0' && c <= '9';
    }
  return digits > 4 * letters;
}

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (true) {
    const std::size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    if (end == text.npos) return lines;
    text.remove_prefix(end + 1);
  }
}

}  // namespace

std::string fitted(const std::string& text, int columns) {
  if (columns < 20) return text;
  const std::vector<std::string_view> lines = lines_of(text);
  const bool fits = std::all_of(lines.begin(), lines.end(),
                                [&](std::string_view line) { return display_width(line) <= columns; });
  if (fits) return text;
  std::string out;
  for (std::size_t at = 0; at < lines.size();) {
    const std::size_t n = group_size(lines, at, columns);
    std::vector<Line> group;
    bool wide = false;
    for (std::size_t i = at; i < at + n; ++i) {
      group.push_back(glyphs(lines[i]));
      wide = wide || width_of(group.back()) > columns;
    }
    const bool matrix =
        contains(lines[at], "⎡") || is_ruled(lines[at]) || (n > 1 && is_numeric(lines, at, n));
    std::string part = wide && matrix ? elided(group, columns) : "";
    if (part.empty())
      for (std::size_t i = 0; i < n; ++i) part += (i ? "\n" : "") + folded(group[i], columns);
    out += (at ? "\n" : "") + part;
    at += n;
  }
  return out;
}

/// A cell of a drawing in ASCII, by its upper and lower dots (U+2800 and the bits of the dots).
static const char* braille_in_ascii(std::string_view bytes) {
  const unsigned dots =
      (static_cast<unsigned char>(bytes[1]) & 3u) << 6 | (static_cast<unsigned char>(bytes[2]) & 63u);
  constexpr unsigned upper = 0b00011011, lower = 0b11100100;
  if (dots & upper && dots & lower) return ":";
  return dots & upper ? "'" : dots & lower ? "." : " ";
}

std::string in_ascii(const std::string& text) {
  struct Spelling {
    const char *shown, *plain;
  };
  static constexpr Spelling signs[] = {
      {"§", "sec. "}, {"°", " deg"},   {"¬", "not "},    {"Å", "A"},     {"ß", "ss"},     {"á", "a"},
      {"ä", "a"},     {"è", "e"},      {"é", "e"},       {"í", "i"},     {"ó", "o"},      {"ö", "o"},
      {"ü", "u"},     {"ø", "o"},      {"ł", "l"},       {"÷", "/"},     {"Ĝ", "G^"},     {"ŷ", "y^"},
      {"ẑ", "z^"},    {"ȳ", "y-"},     {"Ξ", "Xi"},      {"Π", "Pi"},    {"Ψ", "Psi"},    {"Υ", "Upsilon"},
      {"ϑ", "theta"}, {"ϕ", "phi"},    {"ᴿ", "^R"},      {"ᵏ", "^k"},    {"ᵖ", "^p"},     {"ᵗ", "^t"},
      {"ᵘ", "^u"},    {"ʳ", "^r"},     {"ⁿ", "^n"},      {"⁺", "^+"},    {"⁽", "^("},     {"⁾", ")"},
      {"ᵢ", "_i"},    {"ᵣ", "_r"},     {"ₐ", "_a"},      {"ₑ", "_e"},    {"ₒ", "_o"},     {"ₓ", "_x"},
      {"ₕ", "_h"},    {"ₖ", "_k"},     {"ₗ", "_l"},      {"ₘ", "_m"},    {"ₙ", "_n"},     {"ₚ", "_p"},
      {"ₛ", "_s"},    {"ₜ", "_t"},     {"ⱼ", "_j"},      {"₊", "+"},     {"₋", "-"},      {"₍", "("},
      {"₎", ")"},     {"’", "'"},      {"‘", "'"},       {"“", "\""},    {"”", "\""},     {"„", "\""},
      {"•", "*"},     {"⁗", "''''"},   {"ℝ", "R"},       {"ℚ", "Q"},     {"ℂ", "C"},      {"ℓ", "l"},
      {"ℏ", "hbar"},  {"↦", "|->"},    {"⇌", "<=>"},     {"⇒", "=>"},    {"⇔", "<=>"},    {"∀", "for all "},
      {"∏", "Prod"},  {"∑", "Sum"},    {"∓", "-+"},      {"∗", "*"},     {"⋅", "*"},      {"∘", "o"},
      {"∛", "cbrt "}, {"∝", "~"},      {"∠", "angle "},  {"∣", "|"},     {"∥", "||"},     {"∧", "and"},
      {"∨", "or"},    {"∩", "&"},      {"∪", "|"},       {"∫", "int "},  {"∼", "~"},      {"≡", "=="},
      {"≪", "<<"},    {"≫", ">>"},     {"⊗", "x"},       {"⊥", "_|_"},   {"⟂", "_|_"},    {"⋆", "*"},
      {"⋮", ":"},     {"⋱", "."},      {"⟨", "<"},       {"⟩", ">"},     {"⌈", "["},      {"⌉", "]"},
      {"⌊", "["},     {"⌋", "]"},      {"├", "+"},       {"┤", "+"},     {"┬", "+"},      {"┴", "+"},
      {"○", "o"},     {"●", "*"},      {"×", "x"},       {"✓", "ok"},    {"✗", "no"},     {"′", "'"},
      {"″", "''"},    {"‴", "'''"},    {"√", "sqrt "},   {"≈", "~="},    {"≤", "<="},     {"≥", ">="},
      {"≠", "!="},    {"∞", "inf"},    {"∂", "d"},       {"∇", "grad "}, {"Σ", "Sum"},    {"·", "*"},
      {"±", "+-"},    {"…", "..."},    {"⋯", "..."},     {"–", "-"},     {"—", "-"},      {"−", "-"},
      {"→", "->"},    {"←", "<-"},     {"‖", "||"},      {"½", "1/2"},   {"⎡", "["},      {"⎢", "["},
      {"⎣", "["},     {"⎤", "]"},      {"⎥", "]"},       {"⎦", "]"},     {"│", "|"},      {"─", "-"},
      {"┼", "+"},     {"┌", "+"},      {"┐", "+"},       {"└", "+"},     {"┘", "+"},      {"ᵀ", "^T"},
      {"⁻", "^-"},    {"∈", "in"},     {"⁰", "^0"},      {"¹", "^1"},    {"²", "^2"},     {"³", "^3"},
      {"⁴", "^4"},    {"⁵", "^5"},     {"⁶", "^6"},      {"⁷", "^7"},    {"⁸", "^8"},     {"⁹", "^9"},
      {"₀", "0"},     {"₁", "1"},      {"₂", "2"},       {"₃", "3"},     {"₄", "4"},      {"₅", "5"},
      {"₆", "6"},     {"₇", "7"},      {"₈", "8"},       {"₉", "9"},     {"α", "alpha"},  {"β", "beta"},
      {"γ", "gamma"}, {"δ", "delta"},  {"ε", "epsilon"}, {"ζ", "zeta"},  {"η", "eta"},    {"θ", "theta"},
      {"κ", "kappa"}, {"λ", "lambda"}, {"μ", "mu"},      {"ν", "nu"},    {"ξ", "xi"},     {"π", "pi"},
      {"ρ", "rho"},   {"σ", "sigma"},  {"τ", "tau"},     {"φ", "phi"},   {"χ", "chi"},    {"ψ", "psi"},
      {"ω", "omega"}, {"Δ", "Delta"},  {"Φ", "Phi"},     {"Ω", "Omega"}, {"Λ", "Lambda"}, {"Γ", "Gamma"},
      {"Θ", "Theta"}};
  std::string out;
  for (const Glyph& g : glyphs(text)) {
    if (g.bytes.size() == 1) {
      out += g.bytes;
      continue;
    }
    if (g.width == 0) continue;  // a combining accent
    if (g.bytes.size() == 3 && g.bytes >= "\u2800" && g.bytes <= "\u28FF") {
      out += braille_in_ascii(g.bytes);
      continue;
    }
    const auto* sign = std::find_if(std::begin(signs), std::end(signs),
                                    [&](const Spelling& s) { return g.bytes == s.shown; });
    out += sign == std::end(signs) ? "?" : sign->plain;
  }
  return out;
}

}  // namespace pendula::lua
