#include "integrate/event/pulses.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "codegen/kernel/kernel.hpp"

namespace pendula::integrate {
namespace {

constexpr int cells = 2048;
constexpr double change = 2e-3;  // between two samples, relative to the range; smaller changes count as rest
constexpr int stops = 8;         // per pulse: every method resolves a bell curve in eight pieces
constexpr std::size_t most_pulses = 200;  // more are an oscillation, which no step can miss

/// Can e have a short pulse? Sums, products and sines of a smooth argument have none without oscillating, and
/// the borders of abs, min, max and ifelse are located as events.
bool can_pulse(Expr e) {
  const auto varies = [](Expr part) {
    const std::vector<Expr> all = leaves({&part, 1});
    return std::find(all.begin(), all.end(), time_symbol()) != all.end();
  };
  const std::vector<Expr> nodes = topological({&e, 1});
  return std::any_of(nodes.begin(), nodes.end(), [&](Expr node) {
    if (node.is_symbol() || node.is_constant()) return false;
    switch (node.op()) {
      case Op::exp:
      case Op::tanh:
      case Op::cosh:
        return varies(node.operand(0));
      case Op::div:
        return varies(node.operand(1));
      case Op::pow: {
        const mpq_class* n = exact_value(node.operand(1));
        return !n || n->get_den() != 1 || (*n < 0 && varies(node.operand(0)));
      }
      default:
        return false;
    }
  });
}

/// The function changes between the samples first … last. It is constant before `rest_before`
/// and after `rest_behind`.
struct Pulse {
  int first, last;
  int rest_before = first, rest_behind = last;
};

/// Extends a pulse by the feet of a bell curve, since a step that ends in a foot without a stage there misses
/// the pulse. At most by the length of the pulse on either side: the feet of 1/(1 + t²) are unbounded.
void add_feet(Pulse& pulse, const std::vector<double>& f, double range) {
  constexpr double at_rest = 1e-9;  // relative to the range
  const int length = pulse.last - pulse.first;
  const auto moves = [&](int k) { return std::fabs(f[k + 1] - f[k]) > at_rest * range; };
  while (pulse.rest_before > 0 && pulse.first - pulse.rest_before < length && moves(pulse.rest_before - 1))
    --pulse.rest_before;
  while (pulse.rest_behind < cells && pulse.rest_behind - pulse.last < length && moves(pulse.rest_behind))
    ++pulse.rest_behind;
}

/// Changes that take at most `longest` cells and are followed by rest.
std::vector<Pulse> pulses_of(const std::vector<double>& f, int longest) {
  const auto [low, high] = std::minmax_element(f.begin(), f.end());
  const double range = *high - *low;
  std::vector<Pulse> found;
  if (!(range > 0) || !std::isfinite(range)) return found;
  for (int k = 1; k < cells; ++k) {
    if (std::fabs(f[k + 1] - f[k]) <= change * range) continue;
    const int first = k;
    int rest = 0;
    for (; k < cells && rest < 3; ++k) rest = std::fabs(f[k + 1] - f[k]) <= change * range ? rest + 1 : 0;
    if (k - first >= longest || rest < 3) continue;
    found.push_back({first, k});
    add_feet(found.back(), f, range);
  }
  return found;
}

/// The times at which steps should end, for functions given by samples.
std::vector<double> times_of(const std::vector<std::vector<double>>& samples, int longest, double from,
                             double to) {
  std::vector<double> times;
  for (const std::vector<double>& f : samples) {
    const std::vector<Pulse> pulses = pulses_of(f, longest);
    if (pulses.size() > most_pulses) continue;
    for (const Pulse& pulse : pulses) {
      const auto add = [&](double sample) { times.push_back(from + (to - from) * (sample / cells)); };
      add(pulse.rest_before);
      for (int s = 0; s <= stops; ++s)
        add(pulse.first + (pulse.last - pulse.first) * (static_cast<double>(s) / stops));
      add(pulse.rest_behind);
    }
  }
  std::sort(times.begin(), times.end());
  const double distinct = 1e-6 * (to - from) / cells;
  times.erase(std::unique(times.begin(), times.end(), [&](double a, double b) { return b - a <= distinct; }),
              times.end());
  std::erase_if(times, [&](double t) { return t <= from || t >= to; });
  return times;
}

double sample_time(int k, double from, double to) { return from + (to - from) * k / cells; }

}  // namespace

std::vector<Expr> functions_of_time(std::span<const Expr> equations, const std::vector<Expr>& parameters) {
  const std::unordered_set<Expr> known(parameters.begin(), parameters.end());
  std::unordered_set<Expr> timely, constant;
  std::vector<Expr> found;
  for (Expr node : topological(equations)) {
    if (node.is_constant() || known.count(node) ||
        (node.is_symbol() && symbol_of(node).kind == Kind::constant)) {
      constant.insert(node);
      continue;
    }
    if (node == time_symbol()) {
      timely.insert(node);
      continue;
    }
    if (node.is_symbol() || node.op() == Op::call || node.op() == Op::solve) continue;
    const auto parts = node.operands();
    const auto is_time = [&](Expr e) { return timely.count(e) > 0; };
    const auto is_either = [&](Expr e) { return is_time(e) || constant.count(e) > 0; };
    if (std::all_of(parts.begin(), parts.end(), is_either)) {
      const bool any = std::any_of(parts.begin(), parts.end(), is_time);
      (any ? timely : constant).insert(node);
    } else {
      const bool divides = node.op() == Op::div;  // then it is the inverse that may have pulses
      for (std::size_t i = 0; i < parts.size(); ++i)
        if (is_time(parts[i])) found.push_back(divides && i == 1 ? Expr(1) / parts[i] : parts[i]);
    }
  }
  for (Expr e : equations)
    if (timely.count(e)) found.push_back(e);
  std::sort(found.begin(), found.end(), [](Expr a, Expr b) { return a.id() < b.id(); });
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::erase_if(found, [](Expr e) { return !can_pulse(e); });
  return found;
}

std::vector<double> pulse_times(const std::vector<Expr>& functions, const std::vector<Expr>& parameters,
                                std::span<const double> values, double from, double to) {
  constexpr int longest = cells / 30;
  if (functions.empty()) return {};
  std::vector<Expr> arguments{time_symbol()};
  arguments.insert(arguments.end(), parameters.begin(), parameters.end());
  const codegen::Kernel kernel(functions, arguments);
  std::vector<double> at{from}, out(functions.size());
  at.insert(at.end(), values.begin(), values.end());
  std::vector<std::vector<double>> samples(functions.size(), std::vector<double>(cells + 1));
  for (int k = 0; k <= cells; ++k) {
    at[0] = sample_time(k, from, to);
    kernel(at.data(), out.data());
    for (std::size_t i = 0; i < functions.size(); ++i) samples[i][k] = out[i];
  }
  return times_of(samples, longest, from, to);
}

std::vector<double> pulse_times(std::span<const std::function<double(double)>> inputs, double from,
                                double to) {
  std::vector<std::vector<double>> samples(inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i)
    for (int k = 0; k <= cells; ++k) samples[i].push_back(inputs[i](sample_time(k, from, to)));
  return times_of(samples, cells, from, to);
}

}  // namespace pendula::integrate
