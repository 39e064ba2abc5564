// Resets while contacts hold. In a regime bodies in contact move as one, so that a reset of one would be a
// reset of all. Such an event therefore ends the piece, and its reset is applied to the states of the model
// as it was written. It may carry conditions of other events, which rest at their roots, across them: these
// events happen at the same moment, one after the other (Newton's cradle). Contacts that are violated then
// are left to the impulses of the next regime (dae/start/regimes).
#pragma once

#include "dae/start/regime_jump.hpp"
#include "dae/start/regimes.hpp"
#include "integrate/event/at_roots.hpp"
#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

class RegimeImpacts {
 public:
  using Values = std::unordered_map<Expr, double>;
  struct Impact {
    int which;
    bool stop;
    Values before, after;
  };

  /// Requires that simulation and regimes outlive it.
  RegimeImpacts(dae::ModelPtr model, const Simulation& simulation, dae::Regimes& regimes);

  /// The user's events for a piece in this regime. Where its states obey conditions,
  /// those that reset states end it.
  std::vector<ModelEvent> events_in(const dae::Regime& regime);
  /// By event: it ends the piece, see events_in().
  const std::vector<char>& deferred() const { return deferred_; }

  /// Applies the events at the end of a piece. request: what is known there; values: of the leaves of the
  /// model, before and after. Throws Failure where events trigger each other without end.
  std::vector<Impact> settle(const std::vector<EventRecord>& events, const dae::Regime& regime,
                             const dae::StartRequest& request, const dae::Sizes& sizes, Values& values);

  /// That events at one moment may depend on their order; empty: none did.
  const std::string& remark() const { return remark_; }

  /// The condition of an event that resets states at a contact which also transmits an impulse of the start
  /// without an impact law: the equations do not determine how both act together. 0 if there is none.
  Expr law_sharing_impulse(const dae::RegimeStart& start, const dae::StartRequest& request,
                           const dae::Sizes& sizes) const;

 private:
  Values all(const Values& values) const;
  Vec gradient_of(Expr e, const std::vector<Expr>& x, const Values& at) const;
  std::optional<double> slope(Expr when, const Values& at) const;
  bool is_at_root(Expr when, const Values& at, const dae::Sizes& sizes, double fastest) const;
  AtRoots at_roots(const Values& before, const Values& here, const dae::Sizes& sizes) const;
  void remark_order(int which);
  bool is_thrown_back(int which, const Values& before, const Values& here, const dae::Sizes& sizes,
                      const AtRoots& roots) const;
  EventReply reply_to_triggered(int which, std::size_t count) const;
  std::optional<int> overdue(const Values& here, const dae::Sizes& sizes, const AtRoots& roots) const;
  Impact apply(int which, const EventReply& reply, const dae::Regime& regime, Values& values);
  void keep_lasting(const dae::Regime& regime, const std::vector<Expr>& reset, Values& values);

  dae::ModelPtr model_;
  const Simulation& simulation_;
  dae::Regimes& regimes_;
  std::vector<Expr> when_;  ///< by event, in leaves of the model
  std::vector<char> deferred_;
  std::vector<EventReply> replies_;  ///< by event: what its call asked for
  std::vector<double> happened_;     ///< by event: when it did last
  Values known_;                     ///< time, parameters, inputs
  dae::FirstOrder form_;             ///< of the regime
  double interval_ = 0;
  std::string remark_;
};

}  // namespace pendula::integrate
