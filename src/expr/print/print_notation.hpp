// How pieces of mathematics are put on paper: the printer
// (print.cpp) decides what stands where, a notation how it looks.
#pragma once

#include <string>
#include <vector>

#include "base/text.hpp"
#include "expr/normal/normal.hpp"

namespace pendula {

/// How tightly a piece holds together; a piece goes into parentheses where something tighter is needed.
enum class Bind { sum, condition, product, quotient, dot, power, atom };

struct Piece {
  std::string text;
  Bind bind = Bind::atom;
};

class Notation {
 public:
  virtual ~Notation() = default;

  virtual Piece symbol(const Symbol& s) const = 0;
  virtual Piece column(const std::string& name, int order) const = 0;
  virtual Piece unit_vector(int i) const = 0;
  virtual Piece power(const Piece& base, const mpq_class& exponent) const = 0;
  virtual Piece power(const Piece& base, const Piece& exponent) const = 0;
  /// coefficient · above / below, coefficient > 0.
  virtual Piece product(const Number& coefficient, std::vector<Piece> above,
                        std::vector<Piece> below) const = 0;
  virtual Piece dot(const Piece& a, const Piece& b) const = 0;
  virtual Piece root(const Piece& a) const = 0;
  virtual Piece absolute(const Piece& a) const = 0;
  virtual Piece norm(const Piece& a) const = 0;
  virtual Piece function(Op op,
                         const std::vector<Piece>& args) const = 0;  ///< named or cond, not sqrt or abs
  virtual Piece call(const std::string& name, const std::vector<Piece>& args) const = 0;
  /// ∂g/∂x; `wrt` lists the arguments with multiplicity. With
  /// `args`: not plain symbols, the place is given instead.
  virtual Piece partial(const std::string& name, const std::vector<Piece>& wrt) const = 0;
  virtual Piece partial_at(const std::string& name, const std::vector<int>& places,
                           const std::vector<Piece>& args) const = 0;
  /// Component i of the solution of a linear system, which is too large to be written out.
  virtual Piece solution(int i) const { return {"(A⁻¹b)" + subscript(i)}; }
  virtual Piece list(const std::vector<Piece>& entries) const = 0;  ///< a column written out
  virtual Piece elided(const std::string& what) const = 0;
  virtual std::string parenthesised(const std::string& inside) const = 0;

  std::string within(const Piece& p, Bind least) const {
    return p.bind < least ? parenthesised(p.text) : p.text;
  }
};

const Notation& unicode_notation();
const Notation& latex_notation();

/// "theta12" or "theta_12" -> {"theta", "12"}, "K_eq" -> {"K", "eq"}: a name and what is set below the line.
struct SplitName {
  std::string head, below;
};
SplitName split_name(const std::string& name);
/// The Greek letter of that name as Unicode, or "".
std::string greek_letter(const std::string& name);

/// The parts of a positive number that stand above and below the line; a decimal is a numerator.
struct NumberText {
  std::string above, below;  ///< below is "" for 1
};
NumberText number_text(const Number& magnitude);
/// The same before other factors: x/10 and not 0.1 x, but 0.3 x.
NumberText coefficient_text(const Number& magnitude);

/// How rational numbers are written: one way within an expression, a vector or a matrix.
///   mixed      0.2 and 9.81, but 1/2 and 3/4: a finite decimal where 5 divides the denominator
///   fractions  1/5 and 1/3: where a number is no finite decimal, those with small denominators
///   decimals   0.2 and 0.5: lists of nothing but numbers
enum class NumberStyle { mixed, fractions, decimals };

/// The style of these forms for the life of the object; the one before comes back after it.
class NumberStyleScope {
 public:
  NumberStyleScope(const NormalForms& forms, const std::vector<SumId>& sums);
  ~NumberStyleScope();
  NumberStyleScope(const NumberStyleScope&) = delete;
  NumberStyleScope& operator=(const NumberStyleScope&) = delete;

 private:
  NumberStyle before_;
};

}  // namespace pendula
