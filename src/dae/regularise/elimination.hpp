// When leading derivatives cancel between equations: exact elimination over the rationals.
//
// The structure of a model may be trusted only where its system Jacobian J is regular. If rows of J that are
// rational constants are dependent, Σ u_i J_i = 0, then in Σ u_i F_i^(c_i - c), c the least offset in the
// combination, all leading derivatives cancel; it may replace one equation of offset c, which leaves the
// solutions as they are and lowers the value of the greatest transversal (the linear combination method
// with constant u: Tan, Nedialkov & Pryce, Conversion methods for improving structural analysis of
// differential-algebraic equation systems, BIT 57(3), 2017, §3).
#pragma once

#include <string>
#include <vector>

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

/// Equations 0 = residual on their way to a regular structure.
struct Equations {
  std::vector<Expr> residuals, variables;  ///< variables: leaves of order 0
  std::vector<std::string> labels;         ///< of every equation: "(3)", "(2)[1]"
  std::vector<std::string> notes;   ///< what an equation has become: "(3) - (1) - (2)"; empty: as written
  std::vector<Expr> nonzero;        ///< equivalent to the original ones where none of these vanishes
  std::vector<int> differentiated;  ///< how often original equations were differentiated for it
};

Equations equations_of(const Model& model);

struct Structure {
  Signature sigma;
  Offsets offsets;
  std::vector<Entry> jacobian;
  ModularRank rank;
  bool matched = false, regular = false;
  bool singular_on_solutions = false;  ///< generically regular, but not where the equations hold
};

/// Σ-method and generic rank of the system Jacobian, as analyse() does, and for up to 60 equations its rank
/// at points that satisfy them. Requires as many equations as
/// variables.
Structure structure_of(const Equations& e);

enum class Step {
  nothing,   ///< nothing to be done here
  changed,   ///< equations were replaced; the structure must be computed again
  dependent  ///< a combination contains no unknown: the equations depend on each other or contradict
};

/// Takes out leading derivatives that cancel within one equation, as x″ in (x″ + 1)² - x″² - 2 x″.
Step drop_cancelled(Equations& e, const Structure& s, std::vector<std::string>& log);

/// All independent combinations of equations whose rows of J are rational constants, at once.
Step eliminate_constant_rows(Equations& e, const Structure& s, std::vector<std::string>& log);

/// The same for rows that vary: a combination Σ u_i J_i = 0 with rational constants u that holds at every
/// point, found modulo a prime at several points and confirmed on the expressions. One combination per call.
Step eliminate_by_constants(Equations& e, const Structure& s, std::vector<std::string>& log);

/// e without the leaves of these variables on which it does not really depend, tidied.
Expr without_cancelled(Expr e, const std::vector<Expr>& variables);

/// Puts 0 = residual in the place of equation i, with a line in the log; `dependent` if no unknown is left.
Step replace_equation(Equations& e, std::size_t i, Expr residual, const std::string& how,
                      std::vector<std::string>& log);

/// p/q with small p and q from its residue (Wang's algorithm: von zur Gathen & Gerhard, Modern Computer
/// Algebra, 3rd ed., §5.10), or nothing.
std::optional<mpq_class> rational_of(Residue residue);

}  // namespace pendula::dae
