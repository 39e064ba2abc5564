// Equations that are only piecewise smooth: their borders, and how a run treats them.
//
// Every condition, abs, sign, min and max has a border on which a "surface function" is 0. What happens there
// is decided from the expressions (border_smoothness.hpp):
//
//   smooth   both sides agree in value and in slope
//   kink     both sides agree in value
//   open     the sides differ, or it depends on where the border is crossed
//
// A border is located as a root, so that every step sees one side only: a step size that has grown on one
// side may be far too long for the other, even where the equations are smooth. During a step the branch of
// such a border is held fixed ("frozen"): abs(a) → σa, sign(a) → σ, a < b → σ, with a "mode" σ that is
// constant between crossings. Each step then sees smooth equations, crossings are roots along a smooth
// solution, and the next step begins there with the other mode:
//
//   x′ = 2 - abs(x)   →   x′ = 2 - σx,  σ = ±1, and the surface 0 = x
//
// Functions that switch without a branch (atan2, asin(sin u), acos(cos u), atan(tan u), √(v²)) are evaluated
// as they are written, in steps that end on their borders.
//
// Behind a border a frozen branch may have no value, √x of √max(0, x) at x < 0. Where the equations are
// continuous there, it is not frozen; where they jump, the root has the value of its edge, 0, there.
//
// A run may unfreeze borders on which the equations are continuous, where locating does not pay: they are
// evaluated as they are written from then on, and the error control sees to the kinks.
//
// see  Hairer, Nørsett & Wanner I, 2nd ed., §II.6, "Numerical treatment of discontinuities";
//      docs/derivations.md#borders
#pragma once

#include <optional>
#include <span>

#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/event/filippov.hpp"

namespace pendula::integrate {

/// The replacement of a branch of the equations: a number that is constant between crossings.
struct Mode {
  enum class Kind {
    sign,          ///< -1, 0, 1: the sign of the surface function
    less,          ///< 1 where it is negative, else 0
    less_or_equal  ///< 1 where it is negative or 0, else 0
  };
  int number;
  Kind kind;
  bool reversed = false;  ///< of the negative surface function
  /// side: -1, 0, 1.
  double value(double side) const {
    if (reversed) side = -side;
    if (kind == Kind::sign) return side;
    return side < 0 || (side == 0 && kind == Kind::less_or_equal) ? 1 : 0;
  }
};

enum class Smoothness { smooth, kink, open };

/// How a run treats a border: its branches held fixed, as they are written, or combined (filippov.hpp).
enum class Treatment : char { frozen, unfrozen, sliding };

struct Surface {
  Expr when;                ///< the surface is 0 = when
  std::vector<Mode> modes;  ///< none: its branch is not frozen
  Smoothness smoothness = Smoothness::open;
  bool is_edge = false;  ///< of the domain of a function
};

/// A form whose piecewise nodes can be frozen, each surface for itself.
class PiecewiseForm {
 public:
  /// values: of the form's parameters, in their order; the sides of a border may agree for these only.
  PiecewiseForm(dae::FirstOrder form, std::span<const double> values);

  const std::vector<Surface>& surfaces() const { return surfaces_; }
  /// How many modes there are; they are the last parameters of every form.
  int modes() const { return static_cast<int>(modes_.size()); }
  /// The form with each surface treated as asked for; at: values of its leaves, where one slides. Throws
  /// Failure where no combination of the sides stays on a border that slides.
  SlidingForm form(const std::vector<Treatment>& treatment,
                   const std::unordered_map<Expr, double>& at = {}) const;

 private:
  struct Branch {
    Expr node;
    std::size_t place;  ///< among all nodes, operands first
    std::size_t surface;
    Mode::Kind kind;
    bool reversed;
    std::optional<int> mode;       ///< none: never frozen
    int settled = 0;               ///< not 0: the sign that what it compares always has; it has no surface
    std::optional<Expr> combined;  ///< in its place where the border slides (never frozen, or an edge)
  };
  /// A function that leaves its domain behind a border if the branches of that are held fixed.
  struct Limited {
    Expr node;
    std::size_t surface, place;
  };
  void find_branches(const std::vector<Expr>& nodes);
  std::size_t surface_of(Expr when, bool& reversed);
  void number_modes(const std::vector<char>& frozen);
  Substitution frozen(const std::vector<Treatment>& treatment) const;
  void replace(const Branch& branch, const std::vector<Treatment>& treatment,
               Substitution& replacements) const;
  void keep_in_domain(const Limited& one, const std::vector<Treatment>& treatment,
                      Substitution& replacements) const;
  Substitution modes_on(std::size_t surface, double side) const;
  std::vector<std::vector<Limited>> limited_functions(const std::vector<Expr>& nodes,
                                                      const Substitution& all) const;

  dae::FirstOrder form_;
  std::vector<Surface> surfaces_;
  std::vector<Branch> branches_;  ///< operands first
  std::vector<Limited> limited_;  ///< operands first
  std::vector<Expr> modes_;
};

}  // namespace pendula::integrate
