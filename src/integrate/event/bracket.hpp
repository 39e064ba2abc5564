// A zero between two points of opposite sign, by the Illinois method: a secant whose retained end value is
// halved where the same end is kept twice, every fourth time a bisection.
//
// see  Dowell & Jarratt, A modified regula falsi method for computing the root of an equation, BIT 11, 1971
#pragma once

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

}  // namespace pendula::integrate
