#include "integrate/event/jumps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pendula::integrate {
namespace {

struct Piece {
  double a, b, fa, fb;
  double change() const { return std::fabs(fb - fa); }
};

/// The half in which f changes more.
void halve(const std::function<double(double)>& f, Piece& p) {
  const double t = p.a + (p.b - p.a) / 2, ft = f(t);
  if (std::fabs(ft - p.fa) >= std::fabs(p.fb - ft)) {
    p.b = t;
    p.fb = ft;
  } else {
    p.a = t;
    p.fa = ft;
  }
}

}  // namespace

std::optional<double> find_jump(const std::function<double(double)>& f, double from, double to) {
  constexpr std::size_t pieces = 8;
  std::array<Piece, pieces> list;
  std::array<double, pieces> changes;
  double t = from, ft = f(from);
  for (std::size_t k = 0; k < pieces; ++k) {
    const double next = k + 1 == pieces ? to : from + (to - from) * static_cast<double>(k + 1) / pieces;
    list[k] = {t, next, ft, f(next)};
    changes[k] = list[k].change();
    t = next;
    ft = list[k].fb;
  }
  std::sort(changes.begin(), changes.end());
  // Few pieces stand out; where none does, as on a straight line or with a jump in each, the largest is
  // tried.
  const double usual = std::min(3 * changes[1], 0.999 * changes[pieces - 1]);
  for (Piece& piece : list) {
    const double change = piece.change();
    if (!(change > usual) || change <= 1e-9 * (std::fabs(piece.fa) + std::fabs(piece.fb))) continue;
    for (int k = 0; k < 8; ++k) halve(f, piece);
    if (piece.change() < 0.5 * change) continue;  // continuous: a root would leave a sixteenth
    const double rounding =
        2 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(from), std::fabs(to));
    while (piece.b - piece.a > rounding) {
      const double before = piece.b - piece.a;
      halve(f, piece);
      if (piece.b - piece.a >= before) break;
    }
    return piece.b;
  }
  return {};
}

}  // namespace pendula::integrate
