#include "dae/start/regimes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/start_system.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {
namespace {

using Values = std::unordered_map<Expr, double>;

constexpr std::size_t most_candidates = 300;
constexpr double border = 1e-9;  // of the terms of a margin: what counts as 0

/// An expression at values; leaves without value (derivatives that nothing asked for) count as 0.
double value_at(Expr e, Values values) {
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind == Kind::variable) values.try_emplace(leaf, 0.0);
  return pendula::evaluate({&e, 1}, values)[0];
}

/// -1, 0, 1: the sign of a margin just after the start.
int sign_after(Expr margin, const ConsistentState& start, const Values& impulses) {
  constexpr int highest = 4;  // derivative
  double impulse = 0, largest = 0;
  for (const auto& [leaf, size] : impulses) {
    const double part = value_at(partial(margin, leaf), start.values) * size;
    impulse += part;
    largest = std::max(largest, std::fabs(size));
  }
  if (std::fabs(impulse) > border * (1 + largest)) return impulse > 0 ? 1 : -1;
  Expr e = margin;
  for (int order = 0; order <= highest; ++order) {
    double here = 0, size = 0;
    try {
      here = start(e);
      size = size_of_terms(e, start.values);
    } catch (const UserFacing&) {  // a derivative that nothing determines, or a size that contains one
      if (here == 0) return 0;
    }
    if (std::fabs(here) > border * (1 + size)) return here > 0 ? 1 : -1;
    if (margin.op() == Op::ifelse) return 1;
    e = total_derivative(e);
  }
  return 0;
}

std::string answer(const Model& m) {
  const Analysis a = analyse(m);
  return a.regular ? text(a.index, " ", a.dof) : "singular";
}

/// 0 = min(a, b), up to a sign.
bool is_complementarity(Expr residual) {
  if (residual.op() == Op::neg) residual = residual.operand(0);
  return residual.op() == Op::min || residual.op() == Op::max;
}

/// x⁺, and the impulses Λ of z and Δx of x′.
struct Jump {
  Vec change;
  Values impulses;
};

class JumpSystem {
 public:
  JumpSystem(const Regime& regime, const FirstOrder& form, Values before)
      : regime_(regime), form_(form), values_(std::move(before)) {
    for (Expr leaf : leaves(form.F)) values_.try_emplace(leaf, 0.0);
    n_ = static_cast<Eigen::Index>(form.x.size());
    m_ = static_cast<Eigen::Index>(form.z.size());
    const Mat all = jacobian(form.F, unknowns_of_impulses());
    E_ = all.leftCols(n_);
    B_ = all.rightCols(m_);
  }

  /// Nothing where no impulse leads onto the conditions.
  std::optional<Jump> solve() {
    const auto rows = static_cast<Eigen::Index>(regime_.conditions.size());
    Jump jump{Vec::Zero(n_), {}};
    if (rows == 0) return jump;
    Vec impulse = Vec::Zero(m_);
    const Values start = values_;
    for (int k = 0; k < 20; ++k) {
      const Vec G = residuals();
      Mat K = Mat::Zero(E_.rows() + rows, n_ + m_);
      K.topLeftCorner(E_.rows(), n_) = E_;
      K.topRightCorner(E_.rows(), m_) = B_;
      K.bottomLeftCorner(rows, n_) = jacobian(regime_.conditions, form_.x);
      Vec right(K.rows());
      right << -(E_ * jump.change + B_ * impulse), -G;
      const Vec weight = K.rowwise().norm().unaryExpr([](double s) { return s > 0 ? 1 / s : 1.0; });
      const Vec step =
          (weight.asDiagonal() * K).completeOrthogonalDecomposition().solve(weight.cwiseProduct(right));
      jump.change += step.head(n_);
      impulse += step.tail(m_);
      move(start, jump.change);
      if (step.norm() <= 1e-14 * (1 + jump.change.norm() + impulse.norm())) break;
    }
    if (!lands(jump.change, impulse)) return {};
    for (int k = 0; k < 3; ++k) {  // what rounding and the errors of steps have left, the shortest way
      jump.change -=
          jacobian(regime_.conditions, form_.x).completeOrthogonalDecomposition().solve(residuals());
      move(start, jump.change);
    }
    for (Eigen::Index i = 0; i < n_; ++i)
      if (const double x = start.at(form_.x[i]); std::fabs(x + jump.change[i]) <= 1e-12 * std::fabs(x))
        jump.change[i] = -x;
    for (Eigen::Index j = 0; j < m_; ++j) jump.impulses[form_.z[j]] = impulse[j];
    for (Eigen::Index i = 0; i < n_; ++i) jump.impulses[form_.xdot[i]] = jump.change[i];
    return jump;
  }

 private:
  std::vector<Expr> unknowns_of_impulses() const {
    std::vector<Expr> list = form_.xdot;
    list.insert(list.end(), form_.z.begin(), form_.z.end());
    return list;
  }
  Mat jacobian(const std::vector<Expr>& rows, const std::vector<Expr>& columns) const {
    Mat J = Mat::Zero(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
    for (const Entry& e : sparse_jacobian(rows, columns)) J(e.row, e.column) = value_at(e.value, values_);
    return J;
  }
  Vec residuals() const {
    Vec G(static_cast<Eigen::Index>(regime_.conditions.size()));
    for (Eigen::Index i = 0; i < G.size(); ++i) G[i] = value_at(regime_.conditions[i], values_);
    return G;
  }
  void move(const Values& start, const Vec& change) {
    for (Eigen::Index i = 0; i < n_; ++i) values_[form_.x[i]] = start.at(form_.x[i]) + change[i];
  }
  /// Both parts of the equations hold.
  bool lands(const Vec& change, const Vec& impulse) const {
    constexpr double close = 1e-7;
    const Vec r = E_ * change + B_ * impulse;
    const Vec size = E_.cwiseAbs() * change.cwiseAbs() + B_.cwiseAbs() * impulse.cwiseAbs();
    for (Eigen::Index i = 0; i < r.size(); ++i)
      if (!(std::fabs(r[i]) <= close * (1 + size[i]))) return false;
    const Vec G = residuals();
    for (Eigen::Index i = 0; i < G.size(); ++i)
      if (!(std::fabs(G[i]) <= close * (1 + size_of_terms(regime_.conditions[i], values_)))) return false;
    return true;
  }

  const Regime& regime_;
  const FirstOrder& form_;
  Values values_;
  Eigen::Index n_ = 0, m_ = 0;
  Mat E_, B_;
};

/// Values before a jump, of all leaves that a regime knows.
Values values_before(const Model& model, const StartRequest& request) {
  Values values{{time_symbol(), request.t}};
  const auto add = [&](const ParameterValues& list) {
    for (const auto& [p, value] : list) values[p] = pendula::evaluate({&value, 1}, {})[0];
  };
  for (Expr p : model.parameters)
    if (symbol_of(p).value) values[p] = pendula::evaluate({&*symbol_of(p).value, 1}, {})[0];
  add(model.values);
  add(request.parameters);
  for (const auto& [u, e] : request.inputs)
    for (Expr p : leaves({&e, 1}))
      if (symbol_of(p).kind == Kind::parameter && symbol_of(p).value)
        values.try_emplace(p, pendula::evaluate({&*symbol_of(p).value, 1}, {})[0]);
  const Values known = values;
  for (const auto& [u, e] : request.inputs) values[u] = pendula::evaluate({&e, 1}, known)[0];
  for (const auto* list : {&request.guess, &request.fix})
    for (const auto& [leaf, value] : *list) values[leaf] = value;
  return values;
}

/// Fixed values that contradict the constraints by rounding move onto them.
ConsistentStatePtr consistent(const ModelPtr& model, StartRequest request) {
  try {
    return init(model, request);
  } catch (const UserFacing&) {
    request.nearest = true;
    return init(model, request);
  }
}

}  // namespace

ModelPtr region_model(const ModelPtr& model, const Region& region) {
  ModelOptions options = child_of(model);
  options.trace.push_back("in the region " + region.where);
  declare_unknowns(options, *model);
  std::vector<Block> blocks;
  std::size_t next = 0;
  for (const Block& b : model->blocks) {
    Block own{VecX::Zero(b.lhs.size()), VecX::Zero(b.lhs.size()), b.note, b.rewritten};
    for (Eigen::Index row = 0; row < b.lhs.size(); ++row) own.rhs[row] = region.model.residuals[next++];
    blocks.push_back(std::move(own));
  }
  return make_model(std::move(blocks), std::move(options));
}

std::vector<int> signs_after(const Region& region, const ConsistentState& start, const Values& impulses) {
  std::vector<int> signs;
  for (Expr margin : region.margins) signs.push_back(sign_after(margin, start, impulses));
  return signs;
}

bool stays_in(const Region& region, const ConsistentState& start) {
  const std::vector<int> signs = signs_after(region, start);
  return std::find(signs.begin(), signs.end(), -1) == signs.end();
}

Regimes::Regimes(ModelPtr model) : model_(std::move(model)), choices_(*model_) {}

bool Regimes::differ() const {
  constexpr std::size_t few = 3, most = 20, affordable = 100;  // choices; unknowns
  const Model& m = *model_;
  if (choices_.size() == 0 || choices_.size() > most || m.variables.size() > affordable) return false;
  if (m.residuals.size() != m.variables.size()) return false;
  if (std::any_of(m.residuals.begin(), m.residuals.end(), is_complementarity)) return true;
  if (choices_.size() > few) return false;
  const std::string whole = answer(m);
  for (std::uint64_t choice = 0; choice < std::uint64_t{1} << choices_.size(); ++choice)
    if (answer(choices_.region(choice).model) != whole) return true;
  return false;
}

const Regime& Regimes::regime(std::uint64_t choice) {
  const auto known = known_.find(choice);
  if (known != known_.end()) return known->second;
  Regime regime{choice, choices_.region(choice), nullptr, nullptr, 0, {}};
  try {
    const ModelPtr model = region_model(model_, regime.region);
    const Analysis analysis = analyse(*model);
    regime.index = differentiation_index(*model, analysis).index;
    regime.form = regime.index <= 1 && analysis.regular && analysis.index <= 1 ? model : reduce(model, "");
    const std::vector<Expr> states = model->states();
    for (const Constraint& c : hidden_constraints(*model).constraints) {
      const std::vector<Expr> inside = leaves({&c.residual, 1});
      if (std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
            return symbol_of(leaf).kind != Kind::variable ||
                   std::find(states.begin(), states.end(), leaf) != states.end();
          }))
        regime.conditions.push_back(c.residual);
    }
    regime.model = model;
  } catch (const UserFacing&) {
    regime.form = nullptr;  // singular
  }
  return known_.emplace(choice, std::move(regime)).first->second;
}

std::optional<RegimeStart> Regimes::enter_one(const StartRequest& before, std::uint64_t choice,
                                              std::string& why) {
  const Regime& regime = this->regime(choice);
  const auto refused = [&](const std::string& reason) {
    why += "\n  where " + regime.region.where + ": " + reason;
    return std::nullopt;
  };
  if (!regime.model) return refused("the equations are singular");
  const FirstOrder form = first_order(*regime.model);
  const auto jump = JumpSystem(regime, form, values_before(*regime.model, before)).solve();
  if (!jump) return refused("no impulse that the equations allow leads onto the constraints");
  StartRequest request = before;
  bool jumps = false;
  for (auto& [leaf, value] : request.fix)
    if (const auto at = std::find(form.x.begin(), form.x.end(), leaf); at != form.x.end()) {
      const double change = jump->change[at - form.x.begin()];
      jumps = jumps || std::fabs(change) > 1e-7 * (1 + std::fabs(value));
      value += change;
    }
  try {
    auto at = std::make_shared<ConsistentState>(*consistent(regime.model, request));
    std::vector<int> signs = signs_after(regime.region, *at, jumps ? jump->impulses : Values{});
    const auto leaves = [&] { return std::find(signs.begin(), signs.end(), -1) != signs.end(); };
    if (leaves()) return refused("its solution from these values moves outside this region");
    if (jumps) {
      signs = signs_after(regime.region, *at);
      if (leaves()) {  // an impact, and off again
        auto next = enter(request, choice, choice, why);
        if (next) next->jumps = true;
        return next;
      }
    }
    std::vector<double> slack;
    for (std::size_t k = 0; k < signs.size(); ++k)
      slack.push_back(signs[k] > 0 ? 0.0
                                   : 10 * border * (1 + size_of_terms(regime.region.margins[k], at->values)));
    return RegimeStart{&regime, at, jumps, slack};
  } catch (const UserFacing& e) {
    return refused(e.what());
  }
}

std::optional<RegimeStart> Regimes::enter(const StartRequest& request, std::uint64_t near,
                                          std::optional<std::uint64_t> without, std::string& why) {
  const std::uint64_t all = std::uint64_t{1} << choices_.size();
  std::size_t tried = 0;
  for (int flips = 0; flips <= static_cast<int>(choices_.size()); ++flips)
    for (std::uint64_t mask = 0; mask < all; ++mask) {
      if (std::popcount(mask) != flips || (without && (near ^ mask) == *without)) continue;
      if (++tried > most_candidates) return {};
      if (auto found = enter_one(request, near ^ mask, why)) return found;
    }
  return {};
}

}  // namespace pendula::dae
