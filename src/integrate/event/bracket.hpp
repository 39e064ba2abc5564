// A zero between two points of opposite sign, by the Illinois method: a secant whose retained end value is
// halved where the same end is kept twice, every fourth time a bisection.
//
// see  Dowell & Jarratt, A modified regula falsi method for computing the root of an equation, BIT 11, 1971
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace pendula::integrate {

class Bracket {
 public:
  /// Requires left < right and values of opposite sign, which may stand for a sign alone.
  Bracket(double from, double at_from, double to, double at_to)
      : left(from), at_left(at_from), right(to), at_right(at_to) {}

  double left, at_left, right, at_right;

  double length() const { return right - left; }
  double middle() const { return (left + right) / 2; }
  /// The next point to look at, the k-th from 0.
  double next(int k) const {
    return k % 4 == 3 ? middle() : right - at_right * (right - left) / (at_right - at_left);
  }
  /// The value there has the sign of the left end.
  void move_left(double t, double value) {
    left = t;
    at_left = value;
    if (moved_ == -1) at_right /= 2;
    moved_ = -1;
  }
  void move_right(double t, double value) {
    right = t;
    at_right = value;
    if (moved_ == 1) at_left /= 2;
    moved_ = 1;
  }

 private:
  int moved_ = 0;  ///< the end that was moved last: -1 left, 1 right
};

/// A zero of a function that is costly, of which a cheap one differs by a small and smooth error.
class CorrectedZero {
 public:
  /// Both values at a point, of the costly and of the cheap one.
  void look(double t, double value, double cheap) {
    before_ = last_;
    last_ = {t, value, value - cheap};
    ++looks_;
  }
  /// Where to look next: the zero of the cheap function plus the error of the last look, or the line through
  /// the last two. Moves of a few `smallest` are doubled, so that they end behind the zero. NaN: none found.
  /// Requires a bracket that ends at the last look.
  template <class Cheap>
  double next(const Cheap& cheap, const Bracket& in, double smallest) const {
    constexpr double few = 16, beside = 1e-4, none = std::numeric_limits<double>::quiet_NaN();
    const double way = (in.left == last_.t ? in.right : in.left) - last_.t;  // to the other end
    const double slope = looks_ > 1 ? (last_.error - before_.error) / (last_.t - before_.t) : 0;
    double p = last_.t, at_p = last_.value, q = p + beside * way;
    if (looks_ > 1) q = p - at_p * (p - before_.t) / (at_p - before_.value);
    for (int k = 0; k < 3 && std::fabs(q - p) > smallest / 4; ++k) {
      if (!((q - last_.t) / way <= 1)) return none;
      const double at_q = cheap(q) + last_.error + slope * (q - last_.t);
      const double next = q - at_q * (q - p) / (at_q - at_p);
      p = q;
      at_p = at_q;
      q = next;
    }
    const double move = q - last_.t;
    if (std::fabs(move) < few * smallest)
      return last_.t + std::copysign(std::max(2 * std::fabs(move), 0.75 * smallest), way);
    return move / way > 0 && move / way < 1 ? q : none;
  }

 private:
  struct Look {
    double t, value, error;
  };
  Look before_{}, last_{};
  int looks_ = 0;
};

}  // namespace pendula::integrate
