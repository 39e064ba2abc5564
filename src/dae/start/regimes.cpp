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
#include "dae/model/model_key.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/start/start_system.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {
namespace {

using Values = std::unordered_map<Expr, double>;

constexpr std::size_t most_candidates = 300;
constexpr double border = 1e-9;     // of the terms of a margin: what counts as 0 where values are exact
constexpr double close = 1e-7;      // of the terms of a condition: where it holds, as well
constexpr double rounding = 1e-14;  // of the largest term: what a sum may be off by

/// The values as exact ones, then as known to the tolerance of the run that gave them, then as known to its
/// multiples: errors of steps add up.
std::vector<Regimes::Accuracy> readings(double rtol) {
  constexpr double coarsest = 0.03;
  std::vector<Regimes::Accuracy> list{{border, close, true}};
  if (rtol <= 0) return list;
  for (double share : {1.0, 10.0, 100.0})
    if (const double known = share * rtol; known > border && known <= std::max(coarsest, rtol))
      list.push_back({known, std::max(close, 3 * known), false});
  return list;
}

/// An expression at values; leaves without value (derivatives that nothing asked for) count as 0.
double value_at(Expr e, Values values) {
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind == Kind::variable) values.try_emplace(leaf, 0.0);
  return pendula::evaluate({&e, 1}, values)[0];
}

/// x⁺ - x⁻, and the impulses Λ of z and Δx of x′, with what their rounding is measured by.
struct Jump {
  Vec change;
  Values impulses, sizes;
  bool jumps = false;
};

/// What the rounding of leaves is measured by.
struct Sizes {
  Values of;
  double rate = 1;  ///< 1/time: of derivatives that have no size of their own

  double operator()(Expr leaf) const {
    if (const auto at = of.find(leaf); at != of.end()) return std::fabs(at->second);
    const Symbol& symbol = symbol_of(leaf);
    const auto base = of.find(symbol.base);
    return symbol.order == 0 || base == of.end() ? 0 : std::fabs(base->second) * std::pow(rate, symbol.order);
  }
};

/// Values, what they have been before, and the units of those that were computed.
Sizes sizes_at(const ConsistentState& start) {
  Sizes sizes{start.values};
  const auto enlarge = [&](Expr leaf, double size) {
    if (const auto at = sizes.of.find(leaf); at != sizes.of.end())
      at->second = std::max(std::fabs(at->second), size);
  };
  for (const auto& [leaf, size] : start.request.sizes) enlarge(leaf, size);
  for (const auto& [leaf, unit] : start.units) enlarge(leaf, unit);
  double fastest = 0;
  for (Expr x : start.model->states()) {
    const double size = sizes(x), slope = sizes.of.count(derivative_leaf(x)) ? sizes(derivative_leaf(x)) : 0;
    if (size > 0) fastest = std::max(fastest, slope / size);
  }
  if (fastest > 0) sizes.rate = fastest;
  return sizes;
}

/// Σ |∂e/∂y| s over the leaves y of an expression, s their sizes.
double size_of(Expr e, const Values& values, const Sizes& sizes) {
  double sum = 0;
  for (Expr leaf : leaves({&e, 1}))
    if (const double size = sizes(leaf); size > 0)
      sum += std::fabs(value_at(partial(e, leaf), values)) * size;
  return sum;
}

/// -1, 0, 1: the sign of a margin just after the start.
int sign_after(Expr margin, const ConsistentState& start, const Jump& jump, double border) {
  constexpr int highest = 4;  // derivative
  double impulse = 0, noise = 0;
  for (const auto& [leaf, size] : jump.impulses) {
    const double slope = value_at(partial(margin, leaf), start.values);
    impulse += slope * size;
    noise += std::fabs(slope) * jump.sizes.at(leaf);
  }
  if (std::fabs(impulse) > border * noise) return impulse > 0 ? 1 : -1;
  const Sizes sizes = sizes_at(start);
  Expr e = margin;
  for (int order = 0; order <= highest; ++order) {
    double here = 0, size = 0;
    try {
      here = start(e);
      size = size_of(e, start.values, sizes);
    } catch (const UserFacing&) {  // a derivative that nothing determines, or a size that contains one
      if (here == 0) return 0;
    }
    if (std::fabs(here) > border * size) return here > 0 ? 1 : -1;
    if (margin.op() == Op::ifelse) return 1;
    e = total_derivative(e);
  }
  return 0;
}

/// To a share of its terms. A derivative that nothing determines is not.
bool is_zero(Expr e, const ConsistentState& start, const Sizes& sizes, double border) {
  try {
    return std::fabs(start(e)) <= border * size_of(e, start.values, sizes);
  } catch (const UserFacing&) {
    return false;
  }
}

std::string answer(const Model& m) {
  const Analysis a = analyse(m);
  return a.regular ? text(a.index, " ", a.dof) : "singular";
}

/// x⁺ = x⁻ + Δx, with impulses Λ of z.
class JumpSystem {
 public:
  /// sizes: of states, what they have been before; close: of the terms, where equations hold
  JumpSystem(const Regime& regime, const FirstOrder& form, Values before, const LeafValues& sizes,
             double close)
      : regime_(regime), form_(form), close_(close), values_(std::move(before)) {
    for (Expr leaf : leaves(form.F)) values_.try_emplace(leaf, 0.0);
    n_ = static_cast<Eigen::Index>(form.x.size());
    m_ = static_cast<Eigen::Index>(form.z.size());
    const Mat all = jacobian(form.F, unknowns_of_impulses());
    E_ = all.leftCols(n_);
    B_ = all.rightCols(m_);
    sizes_.of = values_;
    for (const auto& [leaf, size] : sizes) sizes_.of[leaf] = std::max(size, sizes_(leaf));
    size_ = Vec(n_);
    for (Eigen::Index i = 0; i < n_; ++i) size_[i] = sizes_(form.x[i]);
    // an impulse is compared with what would change the states by their sizes
    impulse_size_ = Vec::Zero(m_);
    const Vec momentum = E_.cwiseAbs() * size_;
    for (Eigen::Index j = 0; j < m_; ++j)
      for (Eigen::Index i = 0; i < B_.rows(); ++i)
        if (B_(i, j) != 0) impulse_size_[j] = std::max(impulse_size_[j], momentum[i] / std::fabs(B_(i, j)));
  }

  /// Nothing where no impulse leads onto the conditions.
  std::optional<Jump> solve() {
    const auto rows = static_cast<Eigen::Index>(regime_.conditions.size());
    Jump jump{Vec::Zero(n_), {}, {}};
    if (rows == 0) return jump;
    Vec impulse = Vec::Zero(m_);
    const Values start = values_;
    const int most = obeys_conditions(1e-13) ? 0 : 20;
    for (int k = 0; k < most; ++k) {
      const Vec G = residuals();
      Mat K = Mat::Zero(E_.rows() + rows, n_ + m_);
      K.topLeftCorner(E_.rows(), n_) = E_;
      K.topRightCorner(E_.rows(), m_) = B_;
      K.bottomLeftCorner(rows, n_) = jacobian(regime_.conditions, form_.x);
      Vec right(K.rows());
      right << -(E_ * jump.change + B_ * impulse), -G;
      const Vec step = least_step(K, right);
      jump.change += step.head(n_);
      impulse += step.tail(m_);
      move(start, jump.change);
      const auto is_small = [](const Vec& d, const Vec& whole, const Vec& size) {
        return ((d.cwiseAbs() - 1e-14 * (whole.cwiseAbs() + size)).array() <= 0).all();
      };
      if (is_small(step.head(n_), jump.change, size_) && is_small(step.tail(m_), impulse, impulse_size_))
        break;
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
    for (Eigen::Index i = 0; i < n_; ++i) {
      jump.jumps = jump.jumps || std::fabs(jump.change[i]) > close_ * size_[i];
      jump.impulses[form_.xdot[i]] = jump.change[i];
      jump.sizes[form_.xdot[i]] = size_[i];
    }
    for (Eigen::Index j = 0; j < m_; ++j) {
      jump.impulses[form_.z[j]] = impulse[j];
      jump.sizes[form_.z[j]] = impulse_size_[j];
    }
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
    const Vec r = E_ * change + B_ * impulse;
    const Vec size =
        E_.cwiseAbs() * (size_ + change.cwiseAbs()) + B_.cwiseAbs() * (impulse_size_ + impulse.cwiseAbs());
    for (Eigen::Index i = 0; i < r.size(); ++i)
      if (!(std::fabs(r[i]) <= close_ * size[i])) return false;
    return obeys_conditions(close_);
  }
  bool obeys_conditions(double share) const {
    const Vec G = residuals();
    for (Eigen::Index i = 0; i < G.size(); ++i)
      if (!(std::fabs(G[i]) <= share * size_of(regime_.conditions[i], values_, sizes_))) return false;
    return true;
  }
  /// The least solution of K y = right, rows and columns in units of their own; what is 0 to rounding is 0.
  static Vec least_step(const Mat& K, const Vec& right) {
    const auto inverse = [](double s) { return s > 0 ? 1 / s : 1.0; };
    const Vec row = K.rowwise().norm().unaryExpr(inverse);
    const Mat scaled = row.asDiagonal() * K;
    const Vec column = scaled.colwise().norm().transpose().unaryExpr(inverse);
    const Vec y = Mat(scaled * column.asDiagonal())
                      .completeOrthogonalDecomposition()
                      .solve(Vec(row.cwiseProduct(right)));
    const double least = rounding * y.cwiseAbs().maxCoeff();
    return y.unaryExpr([&](double v) { return std::fabs(v) <= least ? 0.0 : v; }).cwiseProduct(column);
  }

  const Regime& regime_;
  const FirstOrder& form_;
  double close_;
  Values values_;
  Sizes sizes_;
  Eigen::Index n_ = 0, m_ = 0;
  Mat E_, B_;
  Vec size_, impulse_size_;  ///< of x, of Λ
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

void raise(LeafValues& sizes, Expr leaf, double least) {
  const auto at =
      std::find_if(sizes.begin(), sizes.end(), [&](const auto& known) { return known.first == leaf; });
  if (at == sizes.end())
    sizes.emplace_back(leaf, least);
  else
    at->second = std::max(at->second, least);
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

static std::vector<int> signs_after(const Region& region, const ConsistentState& start, const Jump& jump,
                                    double border) {
  std::vector<int> signs;
  for (Expr margin : region.margins) signs.push_back(sign_after(margin, start, jump, border));
  return signs;
}

bool stays_in(const Region& region, const ConsistentState& start) {
  const std::vector<int> signs = signs_after(region, start, {}, border);
  return std::find(signs.begin(), signs.end(), -1) == signs.end();
}

Regimes::Regimes(ModelPtr model) : model_(std::move(model)), choices_(*model_) {}

static bool find_difference(const Model& m) {
  constexpr std::size_t few = 3, most = 20;
  const Choices choices(m);
  if (choices.size() == 0 || choices.size() > most) return false;
  if (std::any_of(m.residuals.begin(), m.residuals.end(), is_complementarity)) return true;
  if (choices.size() > few) return false;
  const std::string whole = answer(m);
  for (std::uint64_t choice = 0; choice < std::uint64_t{1} << choices.size(); ++choice)
    if (answer(choices.region(choice).model) != whole) return true;
  return false;
}

bool regimes_differ(const Model& m) {
  constexpr std::size_t affordable = 100;
  if (m.variables.size() > affordable || m.residuals.size() != m.variables.size()) return false;
  static ModelCache<bool> known(cached_models);
  const ModelKey key = key_of(m);
  if (const bool* differ = known.find(key)) return *differ;
  return known.insert(key, find_difference(m));
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

/// Of each margin: what errors may take from it without leaving the region.
static std::vector<double> slack_of(const Region& region, const ConsistentState& start,
                                    const std::vector<int>& signs, const Regimes::Accuracy& accuracy) {
  std::vector<double> slack;
  const Sizes sizes = sizes_at(start);
  const auto is_zero_here = [&](Expr e) { return is_zero(e, start, sizes, accuracy.border); };
  for (std::size_t k = 0; k < signs.size(); ++k) {
    const Expr margin = region.margins[k];
    const double here = std::fabs(value_at(margin, start.values));
    const double size = size_of(margin, start.values, sizes);
    if (signs[k] <= 0)
      slack.push_back(2 * here + accuracy.border * size);
    else if (is_zero_here(margin) && is_zero_here(total_derivative(margin)))
      // one that is 0 and grows like t² is rounding, or an error of the run, at first
      slack.push_back(2 * here + (accuracy.exact ? rounding : accuracy.border) * size);
    else
      slack.push_back(0);
  }
  return slack;
}

std::optional<RegimeStart> Regimes::enter_one(const StartRequest& before, std::uint64_t choice,
                                              const Accuracy& accuracy, std::string& why) {
  const Regime& regime = this->regime(choice);
  const auto refused = [&](const std::string& reason) {
    why += "\n  where " + regime.region.where + ": " + reason;
    return std::nullopt;
  };
  if (!regime.model) return refused("the equations are singular");
  const FirstOrder form = first_order(*regime.model);
  const auto jump =
      JumpSystem(regime, form, values_before(*regime.model, before), before.sizes, accuracy.close).solve();
  if (!jump) return refused("no impulse that the equations allow leads onto the constraints");
  StartRequest request = before;
  for (auto& [leaf, value] : request.fix)
    if (const auto at = std::find(form.x.begin(), form.x.end(), leaf); at != form.x.end())
      value += jump->change[at - form.x.begin()];
  try {
    auto at = std::make_shared<ConsistentState>(*consistent(regime.model, request));
    std::vector<int> signs = signs_after(regime.region, *at, jump->jumps ? *jump : Jump{}, accuracy.border);
    const auto leaves = [&] { return std::find(signs.begin(), signs.end(), -1) != signs.end(); };
    if (leaves()) return refused("its solution from these values moves outside this region");
    if (jump->jumps) {
      signs = signs_after(regime.region, *at, {}, accuracy.border);
      if (leaves()) {  // an impact, and off again
        auto next = enter_within(request, choice, choice, accuracy, why);
        if (next) next->jumps = true;
        return next;
      }
    }
    return RegimeStart{&regime, at, jump->jumps, slack_of(regime.region, *at, signs, accuracy)};
  } catch (const UserFacing& e) {
    return refused(e.what());
  }
}

std::optional<RegimeStart> Regimes::enter_within(const StartRequest& request, std::uint64_t near,
                                                 std::optional<std::uint64_t> without,
                                                 const Accuracy& accuracy, std::string& why) {
  const std::uint64_t all = std::uint64_t{1} << choices_.size();
  const int most = static_cast<int>(choices_.size());
  std::size_t tried = 0;
  for (int k = 0; k <= most; ++k) {
    const int flips = accuracy.exact ? k : (k + 1) % (most + 1);  // what was near is known to end here
    for (std::uint64_t mask = 0; mask < all; ++mask) {
      if (std::popcount(mask) != flips || (without && (near ^ mask) == *without)) continue;
      if (++tried > most_candidates) return {};
      if (auto found = enter_one(request, near ^ mask, accuracy, why)) return found;
    }
  }
  return {};
}

std::optional<RegimeStart> Regimes::enter(const StartRequest& request, std::uint64_t near,
                                          std::optional<std::uint64_t> without, std::string& why,
                                          const Tolerance& tolerance) {
  StartRequest measured = request;
  for (const Accuracy& accuracy : readings(tolerance.rtol)) {
    if (accuracy.exact) {
      if (auto found = enter_within(request, near, without, accuracy, why)) return found;
      for (const auto& [leaf, least] : tolerance.least) raise(measured.sizes, leaf, least);
      continue;
    }
    std::string unused;
    if (auto found = enter_within(measured, near, without, accuracy, unused)) return found;
  }
  return {};
}

}  // namespace pendula::dae
