// Many sets of one explicit ODE, one per SIMD lane.
//
// A lane that is finished takes the next set; it keeps its own t, dt and error control all the time, so that
// the result of a set does not depend on those beside it (lane_step.hpp). Points at wanted times lie inside
// steps of different lanes: they are collected and computed several at a time too, each by the method itself
// with a shorter step, as explicit_stepper.hpp does.
#pragma once

#include <optional>
#include <vector>

#include "integrate/compiled/lane_step.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// Where the sets come from and where their results go.
class EnsembleClient {
 public:
  virtual ~EnsembleClient() = default;
  /// Writes x (n numbers) and p of the next set; its number, or none: there is none left.
  virtual std::optional<int> next(double* x, double* p) = 0;
  /// The point at wanted time number `place`; none: the end.
  virtual void point(int set, std::optional<int> place, double t, const double* x, const double* xdot,
                     const double* p) = 0;
  /// All its points were reported.
  virtual void finished(int set, const Stats& stats) = 0;
  /// Not finite, step size vanished, too many steps, or stiff: a separate run solves it or reports the error.
  virtual void abandoned(int set) = 0;
  /// Does it inspect every step?
  virtual bool watches_steps() const { return false; }
  /// After a step of a lane: has the run to be abandoned?
  virtual bool rejects(int lane, int set, const Point& from, const Point& to, const double* p);
};

struct EnsemblePlan {
  double from = 0, to = 0;
  double dt_first = 0, dt_max = 0;  ///< as in Plan
  double most_steps = 0;
  std::vector<double> times;  ///< ascending, inside [from, to]
  Vec rtol, atol;
  int evaluations_per_step = 0;
};

class Ensemble {
 public:
  Ensemble(std::shared_ptr<const CompiledLaneStep> code, EnsemblePlan plan);
  /// Until there are no sets left. Throws Interrupted, and what the client throws. No allocation per step.
  void run(EnsembleClient& client);

 private:
  using Numbers = std::vector<double>;
  double& at(Numbers& numbers, int k, int l) const { return numbers[k * W_ + l]; }
  bool prepare_starts(EnsembleClient& client);
  void load(EnsembleClient& client, int l);
  void handle_lane(EnsembleClient& client, int l, std::vector<int>& free);
  bool is_rejected(EnsembleClient& client, int l);
  void end_of(const Numbers& numbers, int l, Point& out) const;
  void add_between(EnsembleClient& client, int l, int place, double t);
  void flush(EnsembleClient& client);
  void report_point(EnsembleClient& client, const Numbers& from, int first, int l, const Numbers& p_from,
                    int p_first, int set, std::optional<int> place, double t);
  void set_next_stop(int l);
  void rest(int l);

  std::shared_ptr<const CompiledLaneStep> code_;
  EnsemblePlan plan_;
  int W_, n_, p_;
  double rounding_;
  Numbers state_, out_, work_, row_;
  static constexpr int no_set = -1;  ///< of a lane: an integer, since every step asks for it
  std::vector<int> set_, place_;     ///< of every lane: its set, the next wanted time
  Numbers ready_, ready_out_;        ///< sets that have been started
  std::vector<int> ready_set_;
  int next_ready_ = 0;
  bool exhausted_ = false;  ///< no sets are left to be started
  struct Between {
    int set, place;
    double t;
  };
  Numbers between_, between_out_;
  std::vector<Between> wanted_;
  struct Done {
    int set;
    Stats stats;
  };
  std::vector<Done> done_;
  Point step_from_, step_to_;
};

}  // namespace pendula::integrate
