#include "expr/print/spelling.hpp"

#include <cctype>
#include <string_view>

#include "expr/print/print.hpp"
#include "expr/print/print_notation.hpp"

namespace pendula {
namespace {

struct Spelling {
  const char *plain, *shown;
};
constexpr Spelling greek[] = {
    {"alpha", "α"},   {"beta", "β"},  {"gamma", "γ"},  {"delta", "δ"}, {"epsilon", "ε"}, {"zeta", "ζ"},
    {"eta", "η"},     {"theta", "θ"}, {"iota", "ι"},   {"kappa", "κ"}, {"lambda", "λ"},  {"mu", "μ"},
    {"nu", "ν"},      {"xi", "ξ"},    {"pi", "π"},     {"rho", "ρ"},   {"sigma", "σ"},   {"tau", "τ"},
    {"upsilon", "υ"}, {"phi", "φ"},   {"chi", "χ"},    {"psi", "ψ"},   {"omega", "ω"},   {"Gamma", "Γ"},
    {"Delta", "Δ"},   {"Theta", "Θ"}, {"Lambda", "Λ"}, {"Xi", "Ξ"},    {"Pi", "Π"},      {"Sigma", "Σ"},
    {"Phi", "Φ"},     {"Psi", "Ψ"},   {"Omega", "Ω"}};

constexpr Spelling marks[] = {{"''", "_ddot"}, {"''", ".ddot"}, {"'", "_dot"}, {"'", ".dot"}, {"'", "′"},
                              {"''", "″"},     {"'''", "‴"},    {"0", "₀"},    {"1", "₁"},    {"2", "₂"},
                              {"3", "₃"},      {"4", "₄"},      {"5", "₅"},    {"6", "₆"},    {"7", "₇"},
                              {"8", "₈"},      {"9", "₉"},      {"", "["},     {"", "]"}};

/// Consumes one of the spellings at the beginning of `rest`.
template <std::size_t n>
bool take(std::string_view& rest, const Spelling (&spellings)[n], std::string& out) {
  for (const Spelling& s : spellings)
    if (rest.starts_with(s.shown)) {
      out += s.plain;
      rest.remove_prefix(std::string_view(s.shown).size());
      return true;
    }
  return false;
}

}  // namespace

std::string greek_letter(const std::string& name) {
  for (const Spelling& g : greek)
    if (name == g.plain) return g.shown;
  return "";
}

std::string plain_spelling(const std::string& name) {
  std::string out;
  for (std::string_view rest = name; !rest.empty();) {
    if (take(rest, marks, out) || take(rest, greek, out)) continue;
    const bool index = rest[0] == '_' && rest.size() > 1 && std::isdigit(static_cast<unsigned char>(rest[1]));
    if (!index) out += rest[0];  // q_1 is q1
    rest.remove_prefix(1);
  }
  return out;
}

std::optional<Expr> Spellings::leaf(const std::string& word) {
  if (printed_.empty()) collect();
  if (const auto at = printed_.find(word); at != printed_.end()) return at->second;
  const auto at = plain_.find(plain_spelling(word));
  return at == plain_.end() ? std::nullopt : at->second;
}

void Spellings::collect() {
  for (const Expr leaf : known_) {
    printed_.emplace(to_text(leaf), leaf);
    const Symbol& s = symbol_of(leaf);
    const auto [at, is_new] = plain_.emplace(plain_spelling(s.name + std::string(s.order, '\'')), leaf);
    if (!is_new && at->second != leaf) at->second.reset();
  }
}

}  // namespace pendula
