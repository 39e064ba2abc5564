#include "integrate/problem/problem.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

std::string leaf_name(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  std::string name = s.vector.empty() ? s.name : text(s.vector, "[", s.component, "]");
  for (int k = 0; k < s.order; ++k) name += "′";
  return name;
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
    : model_(std::move(model)), inputs_(std::move(inputs)) {
  const std::size_t n = model_.x.size(), m = model_.z.size();
  PENDULA_ASSERT(model_.xdot.size() == n && model_.F.size() == n + m, "a first-order form with wrong sizes");
  PENDULA_ASSERT(!model_.is_ode() || model_.f.size() == n, "an explicit form with wrong sizes");
  if (parameters.size() != static_cast<Eigen::Index>(model_.p.size())) {
    throw Error(text("", parameters.size(), " values for ", model_.p.size(), " parameters"));
  }
  for (std::size_t i = 0; i < model_.p.size(); ++i)
    if (!std::isfinite(parameters[static_cast<Eigen::Index>(i)]))
      throw Error(text("the parameter ", leaf_name(model_.p[i]), " is not a finite number"));
  for (std::size_t i = inputs_.size(); i < model_.u.size(); ++i) {
    const std::string name = leaf_name(model_.u[i]);
    throw Error(text("the input ", name, " has no values; give inputs = { ", name, " = function(t) … end }"));
  }
  arguments_ = {time_symbol()};
  for (const auto* group : {&model_.x, &model_.xdot, &model_.z, &model_.u, &model_.p})
    arguments_.insert(arguments_.end(), group->begin(), group->end());
  values_.assign(arguments_.size(), 0);
  std::copy(parameters.begin(), parameters.end(), values_.end() - parameters.size());

  F_ = codegen::Kernel(model_.F, arguments_);
  if (is_ode()) {
    f_ = codegen::Kernel(model_.f, arguments_);
    dense_jacobian_ = has_large_solve(model_.f);
  }
}

void Problem::accelerate() {
  accelerated_ = true;
  F_.accelerate();
  f_.accelerate();
  J_.accelerate();
}

/// On first use: explicit methods need no Jacobian, and that of a large reduced model may be dense.
void Problem::need_pattern() const {
  if (has_pattern_) return;
  has_pattern_ = true;
  const std::span<const Expr> unknowns(arguments_.data() + 1, 2 * model_.x.size() + model_.z.size());
  for (const pendula::Entry& entry : sparse_jacobian(model_.F, unknowns)) {
    pattern_.push_back({entry.row, entry.column});
    partials_.push_back(entry.value);
  }
}

const std::vector<Problem::Entry>& Problem::pattern() const {
  need_pattern();
  return pattern_;
}

const std::vector<Expr>& Problem::partials() const {
  need_pattern();
  return partials_;
}

void Problem::place(double t, const double* x, const double* xdot, const double* z) {
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
  for (std::size_t i = 0; i < model_.u.size(); ++i, ++to) {
    *to = inputs_[i](t);
    if (!std::isfinite(*to))
      throw Failure(text("the input ", leaf_name(model_.u[i]), " is ", *to, " at t = ", t));
  }
}

void Problem::set_projections(const std::vector<dae::Projection>& stages) {
  projections_ = stages;
  for (const dae::Projection& stage : stages) projectors_.emplace_back(stage, model_.x, arguments_);
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

void Problem::residual(double* F) { F_(values_.data(), F); }

void Problem::rhs(double* f) { f_(values_.data(), f); }

const std::vector<double>& Problem::jacobian() {
  if (!has_jacobian_) {
    has_jacobian_ = true;
    J_ = codegen::Kernel(partials(), arguments_);
    if (accelerated_) J_.accelerate();
    jacobian_values_.resize(partials_.size());
  }
  J_(values_.data(), jacobian_values_.data());
  return jacobian_values_;
}

std::string Problem::x_name(int i) const { return leaf_name(model_.x[i]); }

std::string Problem::xdot_name(int i) const {
  const Expr leaf = model_.xdot[i];
  return symbol_of(leaf).kind == Kind::slot ? x_name(i) + "′" : leaf_name(leaf);
}

std::string Problem::z_name(int i) const { return leaf_name(model_.z[i]); }

std::string Problem::equation_name(int row) const {
  const auto i = static_cast<std::size_t>(row);
  const bool labelled = i < model_.label.size() && !model_.label[i].empty();
  const std::string name = labelled ? model_.label[i] : text("equation ", row + 1);
  if (i >= model_.sides.size() || !model_.sides[i]) return name;
  const auto& [left, right] = *model_.sides[i];
  return text(name, ": ", to_text(left), " = ", to_text(right));
}

}  // namespace pendula::integrate
