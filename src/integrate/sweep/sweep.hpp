// One model, many parameter sets or starts.
//
// Every run is what simulate() would do for its parameters: a start solved anew, the same method and options.
// A run that fails is listed with its reason and stops nothing. Non-stiff explicit ODEs advance together, one
// run per SIMD lane (ensemble.hpp), with the step sizes of their own: results equal those of single runs to a
// part of the tolerance, and do not depend on the number of workers. What lanes cannot do is done by
// simulate() itself.
#pragma once

#include "integrate/simulation/simulate.hpp"
#include "integrate/sweep/run_results.hpp"
#include "store/record.hpp"

namespace pendula::integrate {

/// The values that distinguish one run from the others.
struct SweepSet {
  std::vector<std::pair<Expr, double>> parameters;
  dae::LeafValues start;       ///< replace or extend what the start fixes
  dae::ConsistentStatePtr at;  ///< a start of its own, or null
};

struct SweepRequest {
  dae::ModelPtr model;
  Simulation simulation;  ///< of all runs; its start is made anew for each from start->request
  int runs = 0;
  std::function<SweepSet(int)> set;  ///< what distinguishes run number 0 … runs - 1
  bool own_starts = false;           ///< sets have an `at`
  /// The varying values, for the records of a store.
  std::function<std::vector<double>(int)> varied;
  int workers = 0;   ///< 0: as many as there are processors
  double limit = 0;  ///< seconds that one run may take; 0: any time
  int lanes = 0;     ///< 1: none; 4 or 8: at most so many, also for few runs; 0: as many as pay
};

class LaneSweep;

/// The results: for every run the values of all leaves at the saved times and at its end.
class Sweep {
 public:
  using Progress = std::function<void(int done)>;
  using Results = std::shared_ptr<const RunResults>;

  /// Decides how the runs are made; none is made yet. keep_ends: without times that were
  /// asked for, only the ends are kept.
  explicit Sweep(SweepRequest request, bool keep_ends = false);
  Sweep(const Sweep&) = delete;
  Sweep& operator=(const Sweep&) = delete;

  /// Makes all runs and keeps the results in memory.
  void run(const Progress& progress);
  /// Makes the runs first … last - 1 that the sink has not, and gives it the results while they come. False:
  /// Ctrl-C. progress: of all runs of that range, with those that were there.
  bool run_into(store::RunSink& sink, int first, int last, const Progress& progress) const;
  /// Takes results from elsewhere.
  void open(Results results, bool complete);
  /// The record of a run that is finished.
  store::Record record(const SharedSlots& slots, int task) const;

  const SweepRequest& request() const { return request_; }
  int runs() const { return request_.runs; }
  bool complete() const { return complete_; }  ///< false: Ctrl-C
  bool done(int run) const { return results_->state(run) == RunResults::State::done; }
  std::string failure(int run) const;  ///< of a run that is not done
  std::vector<int> failures() const { return results_->failures(); }
  const std::vector<double>& times() const { return times_; }
  const std::vector<Expr>& kept_leaves() const { return arguments_; }

  /// Values of expressions, one row per run: at the end of each run, at a saved time (by its number), or at
  /// any time (the runs are repeated unless it is a saved time). NaN where a run failed or ended before.
  /// Throws Error naming a symbol that is not of this model or its lineage.
  Mat final(std::span<const Expr> expressions) const;
  Mat at_saved(std::span<const Expr> expressions, int number) const;
  Mat at(std::span<const Expr> expressions, double t) const;
  /// The same one run after another, ascending: nothing is kept. Runs without a value are left out.
  using Visitor = std::function<void(int run, const double* values)>;
  void each(std::span<const Expr> expressions, std::optional<double> t, const Visitor& visitor) const;

  /// The whole trajectory of one run. Throws what made it fail.
  TrajectoryPtr trajectory(int run) const;

  struct Counts {
    double done = 0, steps = 0, rejected = 0, evaluations = 0, failures = 0;
  };
  Counts counts() const;
  /// How many runs advance together, 1: none; and in words how the runs are made.
  int lanes() const;
  std::string why() const;

 private:
  TrajectoryPtr simulate_one(int run, const std::optional<std::vector<double>>& times) const;
  void keep(const Trajectory& trajectory, const std::vector<double>& times, double* numbers) const;
  bool run_all(SharedSlots& slots, const std::vector<double>& times, const Progress& progress) const;
  bool run_on_lanes(SharedSlots& slots, const std::vector<double>& times, const Progress& progress) const;
  bool run_singly(SharedSlots& slots, const std::vector<double>& times, const Progress& progress) const;
  void visit(const RunResults& results, std::span<const Expr> expressions, std::size_t place,
             const Visitor& visitor) const;
  Mat table(const RunResults& results, std::span<const Expr> expressions, std::size_t place) const;
  std::optional<std::size_t> saved_place(double t) const;
  std::size_t numbers_of(const std::vector<double>& times) const;
  void choose_times(bool keep_ends);

  SweepRequest request_;
  std::vector<double> times_;
  std::vector<Expr> arguments_;  ///< leaves whose values are stored
  Substitution inputs_;
  std::shared_ptr<const LaneSweep> on_lanes_;
  std::string why_;
  mutable int apart_ = 0;  ///< runs that lanes were tried for in vain
  Results results_;
  bool complete_ = true;
};

}  // namespace pendula::integrate
