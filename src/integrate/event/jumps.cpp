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

constexpr std::size_t eighths = 8;
using Eighths = std::array<Piece, eighths>;

Eighths eighths_of(const std::function<double(double)>& f, double from, double to) {
  Eighths list;
  double t = from, ft = f(from);
  for (std::size_t k = 0; k < eighths; ++k) {
    const double next = k + 1 == eighths ? to : from + (to - from) * static_cast<double>(k + 1) / eighths;
    list[k] = {t, next, ft, f(next)};
    t = next;
    ft = list[k].fb;
  }
  return list;
}

std::optional<double> jump_in(const std::function<double(double)>& f, const Eighths& list, double size) {
  // relative to |f|: the change seen by a step that ends just after a kink
  constexpr double min_jump = 1e-11;
  std::array<double, eighths> changes;
  for (std::size_t k = 0; k < eighths; ++k) changes[k] = list[k].change();
  std::sort(changes.begin(), changes.end());
  // A jump makes few eighths stand out. If none does, as on a straight line or with a jump in each eighth,
  // the largest is tried.
  const double usual = std::min(3 * changes[1], 0.999 * changes[eighths - 1]);
  for (Piece piece : list) {
    const double change = piece.change();
    if (!(change > usual) || change <= 1e-9 * (std::fabs(piece.fa) + std::fabs(piece.fb)) ||
        change <= min_jump * size)
      continue;
    for (int k = 0; k < 8 && piece.change() >= 0.5 * change; ++k) halve(f, piece);
    if (piece.change() < 0.5 * change) continue;  // continuous: even a root would leave only 1/16
    // bisect down to adjacent numbers: the input before the jump is evaluated at the lower one
    // below it, halvings towards 0 would go on to the smallest double
    const double least = 1e-20 * std::max(std::fabs(list.front().a), std::fabs(list.back().b));
    for (double before = INFINITY; piece.b - piece.a < before && before > least; halve(f, piece))
      before = piece.b - piece.a;
    return piece.b;
  }
  return {};
}

/// f at a < m < b, with m in the middle.
struct Triple {
  double a, m, b, fa, fm, fb;
  double bend() const { return std::fabs(fa - 2 * fm + fb); }
};

/// The one of the three triples of half the size with the largest second difference.
void halve(const std::function<double(double)>& f, Triple& p) {
  const double l = p.a + (p.m - p.a) / 2, r = p.m + (p.b - p.m) / 2, fl = f(l), fr = f(r);
  const Triple parts[] = {
      {p.a, l, p.m, p.fa, fl, p.fm}, {l, p.m, r, fl, p.fm, fr}, {p.m, r, p.b, p.fm, fr, p.fb}};
  p = *std::max_element(std::begin(parts), std::end(parts),
                        [](const Triple& x, const Triple& y) { return x.bend() < y.bend(); });
}

/// A change Δ of slope at distance d from the middle of a triple of length 2 δ has the second difference Δ (δ
/// - |d|). Two halvings leave between 1/8 and 1/2 of it, four leave between 1/32 and 1/8; of the contribution
/// of f″ they leave 1/16 and 1/256.
std::optional<double> kink_in(const std::function<double(double)>& f, const Eighths& list, double rounding,
                              double size) {
  constexpr std::size_t most = 4;  // triples that stand out: those of two kinks
  std::array<Triple, eighths - 1> triples;
  double largest = 0, change = 0;
  for (std::size_t k = 0; k + 1 < eighths; ++k) {
    const Piece &left = list[k], &right = list[k + 1];
    triples[k] = {left.a, left.b, right.b, left.fa, left.fb, right.fb};
    largest = std::max(largest, triples[k].bend());
    change = std::max({change, left.change(), right.change()});
  }
  const double from = list.front().a, to = list.back().b;
  const double noise = 1e3 * std::numeric_limits<double>::epsilon() * size +
                       8 * rounding * change / (list[0].b - list[0].a);  // rounding of f, and of t in f
  const auto stands_out = [&](const Triple& t) { return t.bend() > 0.7 * largest; };
  if (largest <= std::max(1e-9 * size, 64 * noise) ||
      std::count_if(triples.begin(), triples.end(), stands_out) > static_cast<std::ptrdiff_t>(most))
    return {};
  for (Triple triple : triples) {
    const double bend = triple.bend();
    if (!stands_out(triple)) continue;
    for (int k = 0; k < 2; ++k) halve(f, triple);
    if (triple.bend() < bend / 12) continue;
    for (int k = 0; k < 2; ++k) halve(f, triple);
    if (triple.bend() < bend / 64) continue;
    while (triple.bend() > noise && triple.b - triple.a > 4 * rounding) halve(f, triple);
    if (triple.bend() > 4 * noise) continue;  // a jump of a rounded number
    const double end = 1e-6 * (to - from);    // a step that ends at a kink finds it again
    if (triple.a - from > end && to - triple.b > end) return triple.b;  // no further kink is searched for
  }
  return {};
}

}  // namespace

std::optional<double> find_break(const std::function<double(double)>& f, double from, double to,
                                 bool at_break, double& size) {
  const double rounding =
      2 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(from), std::fabs(to));
  if (at_break) to = std::max(to - 32 * rounding, from + (to - from) / 2);
  const Eighths list = eighths_of(f, from, to);
  for (const Piece& piece : list) size = std::max({size, std::fabs(piece.fa), std::fabs(piece.fb)});
  if (const auto jump = jump_in(f, list, size)) return jump;
  return kink_in(f, list, rounding, size);
}

}  // namespace pendula::integrate
