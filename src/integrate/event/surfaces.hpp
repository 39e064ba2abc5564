// Equations that are only piecewise smooth: their branches are held fixed during a step.
//
// Every condition, abs, sign, min and max is replaced by what it is on one side of its switching surface,
// said by a "mode" that is constant between crossings: abs(a) → σa, sign(a) → σ, a < b → σ. Each step then
// sees smooth equations, crossings are roots of the surface function along a smooth solution and are located
// exactly, and the next step begins there with the other mode.
//
//   x′ = 2 - abs(x)   →   x′ = 2 - σx,  σ = ±1, and the surface 0 = x
//
// see  Hairer, Nørsett & Wanner I, 2nd ed., §II.6, "Numerical treatment of discontinuities"
#pragma once

#include "dae/model/first_order.hpp"

namespace pendula::integrate {

/// What a branch of the equations became: a number that is constant between crossings.
struct Mode {
  enum class Kind {
    sign,          ///< -1, 0, 1: the sign of the surface function
    less,          ///< 1 where it is negative, else 0
    less_or_equal  ///< 1 where it is negative or 0, else 0
  };
  int number;
  Kind kind;
  /// side: -1, 0, 1.
  double value(double side) const {
    if (kind == Kind::sign) return side;
    return side < 0 || (side == 0 && kind == Kind::less_or_equal) ? 1 : 0;
  }
};

struct Surface {
  Expr when;  ///< the surface is 0 = when
  std::vector<Mode> modes;
};

struct Surfaces {
  std::vector<Surface> list;
  int modes = 0;  ///< how many; the last parameters of the form
};

/// The surfaces of the form's equations; with `freeze`, the equations are rewritten as above and the modes
/// become parameters of the form. Not rewritten, with modes = 0, where a root or a logarithm may leave its
/// domain on the other side of a surface.
Surfaces switching_surfaces(dae::FirstOrder& form, bool freeze);

}  // namespace pendula::integrate
