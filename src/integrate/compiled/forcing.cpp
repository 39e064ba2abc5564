#include "integrate/compiled/forcing.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/compiled/step_cache.hpp"

namespace pendula::integrate {
namespace {

bool is_cheap(Op op) { return op == Op::neg || op == Op::add || op == Op::sub || op == Op::mul; }

/// Finds the nodes that contain t or an input, but no unknown and no operation without a lane version.
class Timed {
 public:
  explicit Timed(const Problem& problem) {
    const std::vector<Expr>& all = problem.arguments();
    const auto p = static_cast<std::ptrdiff_t>(parameter_count(problem)),
               u = static_cast<std::ptrdiff_t>(input_count(problem));
    times_.insert(all.front());
    times_.insert(all.end() - p - u, all.end() - p);
    fixed_.insert(all.end() - p, all.end());
  }
  void visit(Expr node) {
    const auto operands = node.operands();
    bool known = !node.is_symbol() || times_.count(node) > 0 || fixed_.count(node) > 0 ||
                 symbol_of(node).kind == pendula::Kind::constant;
    known = known && node.op() != Op::call && node.op() != Op::solve &&
            std::all_of(operands.begin(), operands.end(), [&](Expr e) { return of_[e].known; });
    const bool moves = times_.count(node) > 0 ||
                       std::any_of(operands.begin(), operands.end(), [&](Expr e) { return of_[e].moves; });
    of_[node] = {known, moves};
  }
  bool operator()(Expr node) const { return of_.at(node).known && of_.at(node).moves; }

 private:
  struct State {
    bool known = false, moves = false;
  };
  std::unordered_set<Expr> times_, fixed_;
  std::unordered_map<Expr, State> of_;
};

}  // namespace

TimePart::TimePart(std::vector<Expr> given, const Problem& problem) : outputs(std::move(given)) {
  Timed timed(problem);
  std::unordered_set<Expr> taken;
  const auto take = [&](Expr e) {
    if (!e.is_symbol() && timed(e) && taken.insert(e).second) parts.push_back(e);
  };
  for (Expr node : topological(outputs)) {
    timed.visit(node);
    if (timed(node)) continue;
    for (Expr operand : node.operands()) take(operand);
  }
  for (Expr e : outputs) take(e);
  const auto inside = topological(parts);
  const bool worthwhile = std::any_of(inside.begin(), inside.end(), [](Expr e) {
    return !e.is_symbol() && !e.is_constant() && !is_cheap(e.op());
  });
  if (!worthwhile) parts.clear();
  Substitution put;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    symbols.push_back(symbol(pendula::Kind::slot, text("time_part_", k + 1)));
    put[parts[k]] = symbols.back();
  }
  outputs = substitute(outputs, put);
}

std::shared_ptr<const codegen::Machine> TimeCode::compile(const TimePart& part, const Problem& problem) {
  const std::size_t u = input_count(problem), p = parameter_count(problem);
  codegen::Writer w(3 + u + p);
  const codegen::Slot time = w.put(Op::add, w.input(0), w.put(Op::mul, w.input(1), w.input(2)));
  std::vector<Expr> known = problem.arguments();
  known.erase(known.begin() + 1, known.end() - static_cast<std::ptrdiff_t>(u + p));
  auto results = w.inlined(codegen::lower(part.parts, known), arguments(time, {inputs_from(w, 3, u + p)}));
  return codegen::Machine::compile(w.finish(std::move(results)), lanes, codegen::Rounding::fused);
}

TimeCode::TimeCode(std::shared_ptr<const codegen::Machine> machine, const Problem& problem,
                   std::vector<double> c)
    : machine_(std::move(machine)),
      times_(c.size()),
      inputs_(3 + input_count(problem) + parameter_count(problem)),
      in_(passes(times_) * inputs_ * lanes),
      work_(machine_->workspace_size()) {
  c.resize(passes(times_) * lanes, c.back());
  for (std::size_t i = 0; i < c.size(); ++i) in_.data()[(i / lanes * inputs_ + 2) * lanes + i % lanes] = c[i];
}

void TimeCode::start(double t, double dt) {
  for (std::size_t pass = 0; pass < passes(times_); ++pass) {
    double* const in = in_.data() + pass * inputs_ * lanes;
    std::fill_n(in, lanes, t);
    std::fill_n(in + lanes, lanes, dt);
  }
}

void TimeCode::run(const Problem& problem, const double* stages, std::size_t parts, double* out) {
  const std::size_t u = input_count(problem), fixed = 3 + u;
  const double* const p = problem.values().data() + problem.values().size() - (inputs_ - fixed);
  for (std::size_t first = 0; first < times_; first += lanes, out += parts * lanes) {
    double* const in = in_.data() + first * inputs_;
    for (std::size_t k = 0; k < u; ++k)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        in[(3 + k) * lanes + lane] = stages[std::min(first + lane, times_ - 1) * (1 + u) + 1 + k];
    for (std::size_t k = fixed; k < inputs_; ++k) std::fill_n(in + k * lanes, lanes, p[k - fixed]);
    machine_->run(in, out, work_.data());
  }
}

}  // namespace pendula::integrate
