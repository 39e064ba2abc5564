#include "dae/pencil/pencil_forcing.hpp"

#include <algorithm>

#include "base/limits/stack.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

Forcing constant(Expr c) { return {{0, 0, 0, c, 0}}; }

void add(Forcing& sum, const Forcing& terms, Expr factor) {
  for (ForcingTerm t : terms) {
    t.cosine = factor * t.cosine;
    t.sine = factor * t.sine;
    sum.push_back(t);
  }
}

/// Products of sines and cosines as sums: cos x cos y = (cos(x-y) + cos(x+y))/2 and so on.
Forcing product(const Forcing& left, const Forcing& right) {
  Forcing out;
  for (const ForcingTerm& l : left)
    for (const ForcingTerm& r : right) {
      const Expr half = Expr(mpq_class(1, 2));
      ForcingTerm t;
      t.power = l.power + r.power;
      t.rate = simplify(l.rate + r.rate);
      t.frequency = simplify(l.frequency + r.frequency);
      t.cosine = half * (l.cosine * r.cosine - l.sine * r.sine);
      t.sine = half * (l.cosine * r.sine + l.sine * r.cosine);
      out.push_back(t);
      t.frequency = simplify(l.frequency - r.frequency);
      t.cosine = half * (l.cosine * r.cosine + l.sine * r.sine);
      t.sine = half * (l.sine * r.cosine - l.cosine * r.sine);
      out.push_back(t);
    }
  return out;
}

/// slope·t + offset
std::optional<std::pair<Expr, Expr>> line(Expr e) {
  const Expr slope = simplify(partial(e, time_symbol()));
  if (varies(slope)) return {};
  const Expr offset = simplify(substitute(e, {{time_symbol(), 0}}));
  if (varies(offset)) return {};
  return std::pair{slope, offset};
}

class Reader {
 public:
  std::optional<Forcing> read(Expr e) {
    check_stack();
    if (!varies(e)) return constant(e);
    if (e == time_symbol()) return Forcing{{1, 0, 0, 1, 0}};
    switch (e.op()) {
      case Op::add:
      case Op::sub:
      case Op::neg:
        return read_sum(e);
      case Op::mul:
        return read_product(e.operand(0), e.operand(1));
      case Op::div:
        if (!varies(e.operand(1))) return read_product(e.operand(0), 1 / e.operand(1));
        break;
      case Op::pow:
        if (auto power = read_power(e)) return power;
        break;
      case Op::exp:
      case Op::sin:
      case Op::cos:
      case Op::sinh:
      case Op::cosh:
        if (const auto argument = line(e.operand(0)))
          return read_function(e.op(), argument->first, argument->second);
        break;
      default:
        break;
    }
    culprit = e;
    return {};
  }
  Expr culprit;

 private:
  std::optional<Forcing> read_sum(Expr e) {
    auto sum = read(e.operand(0));
    if (!sum) return {};
    Forcing out;
    add(out, *sum, e.op() == Op::neg ? Expr(-1) : Expr(1));
    if (e.op() == Op::neg) return out;
    const auto second = read(e.operand(1));
    if (!second) return {};
    add(out, *second, e.op() == Op::sub ? Expr(-1) : Expr(1));
    return out;
  }

  std::optional<Forcing> read_product(Expr a, Expr b) {
    const auto left = read(a);
    if (!left) return {};
    const auto right = read(b);
    if (!right) return {};
    return product(*left, *right);
  }

  std::optional<Forcing> read_power(Expr e) {
    const Expr base = e.operand(0), exponent = e.operand(1);
    if (!varies(base)) {  // 2^t = e^{t log 2}
      const auto argument = line(exponent);
      if (!argument) return {};
      return read_function(Op::exp, argument->first * log(base), argument->second * log(base));
    }
    const mpq_class* n = exact_value(exponent);
    if (!n || n->get_den() != 1 || *n < 1 || *n > 50) return {};
    const auto factor = read(base);
    if (!factor) return {};
    Forcing out = *factor;
    for (long k = 1; k < n->get_num().get_si(); ++k) {
      out = product(out, *factor);
      if (out.size() > 10'000) return {};
    }
    return out;
  }

  static Forcing read_function(Op op, Expr slope, Expr offset) {
    const Expr half = Expr(mpq_class(1, 2));
    switch (op) {
      case Op::exp:
        return {{0, slope, 0, exp(offset), 0}};
      case Op::sin:
        return {{0, 0, slope, sin(offset), cos(offset)}};
      case Op::cos:
        return {{0, 0, slope, cos(offset), -sin(offset)}};
      default:
        return {{0, slope, 0, half * exp(offset), 0},
                {0, simplify(-slope), 0, (op == Op::sinh ? -half : half) * exp(-offset), 0}};
    }
  }
};

}  // namespace

std::optional<Forcing> forcing_of(Expr e, Expr* culprit) {
  Reader reader;
  auto terms = reader.read(e);
  if (!terms && culprit) *culprit = reader.culprit;
  return terms;
}

std::vector<ForcingGroup> grouped(const Forcing& terms) {
  std::vector<ForcingGroup> groups;
  for (ForcingTerm t : terms) {
    // cos(-bt) = cos(bt), sin(-bt) = -sin(bt)
    const bool negative =
        t.frequency.is_constant() ? constant_value(t.frequency) < 0 : t.frequency.op() == Op::neg;
    if (negative) {
      t.frequency = -t.frequency;
      t.sine = -t.sine;
    }
    if (t.frequency.is_zero()) t.sine = 0;
    auto g = std::find_if(groups.begin(), groups.end(), [&](const ForcingGroup& x) {
      return x.rate == t.rate && x.frequency == t.frequency;
    });
    if (g == groups.end()) g = groups.insert(g, {t.rate, t.frequency, {}, {}});
    const auto size = static_cast<std::size_t>(t.power) + 1;
    if (g->p.size() < size) {
      g->p.resize(size);
      g->q.resize(size);
    }
    g->p[size - 1] += t.cosine;
    g->q[size - 1] += t.sine;
  }
  for (ForcingGroup& g : groups) {
    for (auto* list : {&g.p, &g.q})
      for (Expr& e : *list) e = simplify(e);
    while (!g.p.empty() && g.p.back().is_zero() && g.q.back().is_zero()) {
      g.p.pop_back();
      g.q.pop_back();
    }
  }
  std::erase_if(groups, [](const ForcingGroup& g) { return g.p.empty(); });
  return groups;
}

}  // namespace pendula::dae
