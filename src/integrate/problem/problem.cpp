#include "integrate/problem/problem.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

std::string leaf_name(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  return (s.vector.empty() ? s.name : text(s.vector, "[", s.component, "]")) + primes(s.order);
}

bool has_large_solve(const std::vector<Expr>& f) {
  constexpr int large = 60;
  if (f.size() < static_cast<std::size_t>(large)) return false;
  const std::vector<Expr> nodes = topological(f);
  return std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    return node.op() == Op::solve && component_of(node) == 0 && system_of(node).size >= large;
  });
}

}  // namespace

Problem::Problem(dae::FirstOrder model, Vec parameters, std::vector<Input> inputs)
    : equations_(std::make_shared<Equations>()) {
  const std::size_t n = model.x.size(), m = model.z.size();
  PENDULA_ASSERT(model.xdot.size() == n && model.F.size() == n + m, "a first-order form with wrong sizes");
  PENDULA_ASSERT(!model.is_ode() || model.f.size() == n, "an explicit form with wrong sizes");
  std::vector<Expr>& arguments = equations_->arguments;
  arguments = {time_symbol()};
  for (const auto* group : {&model.x, &model.xdot, &model.z, &model.u, &model.p})
    arguments.insert(arguments.end(), group->begin(), group->end());
  equations_->model = std::move(model);
  values_.assign(arguments.size(), 0);
  set_numbers(parameters, std::move(inputs));
  F_ = codegen::Kernel(this->model().F, arguments);
  if (!is_ode()) return;
  f_ = codegen::Kernel(this->model().f, arguments, codegen::Divisions::shared);
  equations_->dense_jacobian = has_large_solve(this->model().f);
}

void Problem::set_numbers(const Vec& parameters, std::vector<Input> inputs) {
  const auto& p = model().p;
  if (parameters.size() != static_cast<Eigen::Index>(p.size()))
    throw Error(text("", parameters.size(), " values for ", p.size(), " parameters"));
  for (std::size_t i = 0; i < p.size(); ++i)
    if (!std::isfinite(parameters[i]))
      throw Error(text("the parameter ", leaf_name(p[i]), " is not a finite number"));
  inputs_ = std::move(inputs);
  for (std::size_t i = inputs_.size(); i < model().u.size(); ++i) {
    const std::string name = leaf_name(model().u[i]);
    throw Error(text("the input ", name, " has no values; give inputs = { ", name, " = function(t) … end }"));
  }
  std::copy(parameters.begin(), parameters.end(), values_.end() - parameters.size());
  ++version_;
}

void Problem::accelerate() {
  accelerated_ = true;
  F_.accelerate();
  f_.accelerate();
  J_.accelerate();
}

const Problem::Derivatives& Problem::derivatives() const {
  Equations& all = *equations_;
  if (all.derivatives) return *all.derivatives;
  const std::span<const Expr> unknowns(all.arguments.data() + 1, 2 * all.model.x.size() + all.model.z.size());
  Derivatives found;
  for (const pendula::Entry& entry : sparse_jacobian(all.model.F, unknowns)) {
    found.pattern.push_back({entry.row, entry.column});
    found.partials.push_back(entry.value);
  }
  return all.derivatives.emplace(std::move(found));
}

void Problem::set_point(double t, const double* x, const double* xdot, const double* z) {
  double* to = unknowns();
  to = std::copy_n(x, n(), to);
  to = std::copy_n(xdot, n(), to);
  std::copy_n(z, m(), to);
  set_time(t);
}

void Problem::set_time(double t) {
  values_[0] = t;
  if (inputs_.empty()) return;
  if (t >= limit_) t = std::nextafter(limit_, -std::numeric_limits<double>::infinity());
  double* to = values_.data() + 1 + 2 * n() + m();
  for (std::size_t i = 0; i < model().u.size(); ++i, ++to) {
    *to = inputs_[i](t);
    if (!std::isfinite(*to))
      throw Failure(text("the input ", leaf_name(model().u[i]), " is ", *to, " at t = ", t));
  }
}

void Problem::set_projections(const std::vector<dae::Projection>& stages) {
  projections_ = stages;
  projectors_.reserve(stages.size());
  for (const dae::Projection& stage : stages) projectors_.emplace_back(stage, model().x, arguments());
}

void Problem::project(double t, Vec& x) {
  std::fill_n(std::copy_n(x.data(), n(), unknowns()), n() + m(), 0.0);  // x′ and z do not occur in conditions
  set_time(t);
  for (Projector& projector : projectors_) projector.run(values_, 1);
  std::copy_n(values_.begin() + 1, n(), x.data());
}

bool Problem::project_if_needed(double t, Vec& x, const Vec& rtol, const Vec& atol, double share) {
  std::copy_n(x.data(), n(), unknowns());
  set_time(t);
  bool moved = false;
  for (Projector& projector : projectors_) {
    if (!moved && projector.holds(values_, 1, rtol, atol, share)) continue;
    projector.run(values_, 1);
    moved = true;
  }
  if (moved) std::copy_n(values_.begin() + 1, n(), x.data());
  return moved;
}

void Problem::set_modes(const std::vector<double>& modes) {
  const auto first = values_.end() - static_cast<std::ptrdiff_t>(modes.size());
  if (std::equal(modes.begin(), modes.end(), first)) return;
  std::copy(modes.begin(), modes.end(), first);
  ++version_;
}

void Problem::take_parameters(const Problem& other) {
  const auto n = static_cast<std::ptrdiff_t>(model().p.size());
  if (std::equal(values_.end() - n, values_.end(), other.values_.end() - n)) return;
  std::copy(other.values_.end() - n, other.values_.end(), values_.end() - n);
  ++version_;
}

void Problem::residual(double* F) { F_(values_.data(), F); }

void Problem::rhs(double* f) { f_(values_.data(), f); }

const std::vector<double>& Problem::jacobian() {
  if (!has_jacobian_) {
    has_jacobian_ = true;
    J_ = codegen::Kernel(partials(), arguments());
    if (accelerated_) J_.accelerate();
    jacobian_values_.resize(partials().size());
  }
  J_(values_.data(), jacobian_values_.data());
  return jacobian_values_;
}

/// Number i of [x, ∂x/∂p₁, ∂x/∂p₂ …].
static std::string name_with_sensitivities(const std::vector<Expr>& x, int shown, const std::vector<Expr>& by,
                                           int i) {
  if (i < shown || by.empty()) return leaf_name(x[i]);
  return text("∂", leaf_name(x[i % shown]), "/∂", leaf_name(by[i / shown - 1]));
}

std::string Problem::x_name(int i) const {
  return name_with_sensitivities(model().x, visible_n(), sensitivities_, i);
}

std::string Problem::xdot_name(int i) const {
  const Expr leaf = model().xdot[i];
  return symbol_of(leaf).kind == Kind::slot ? x_name(i) + "′" : leaf_name(leaf);
}

std::string Problem::z_name(int i) const {
  return name_with_sensitivities(model().z, visible_m(), sensitivities_, i);
}

std::string Problem::equation_name(int row) const {
  const auto i = static_cast<std::size_t>(row);
  const bool labelled = i < model().label.size() && !model().label[i].empty();
  const std::string name = labelled ? model().label[i] : text("equation ", row + 1);
  if (i >= model().sides.size() || !model().sides[i]) return name;
  const auto& [left, right] = *model().sides[i];
  return text(name, ": ", to_text(left), " = ", to_text(right));
}

}  // namespace pendula::integrate
