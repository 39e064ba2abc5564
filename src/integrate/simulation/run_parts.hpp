// One solution made of runs of different models with the same leaves: forms "dummy" with other states, forms
// "array" with other rows, regimes with other equations.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// The leaves of a problem of the model itself, in the order x, x′, z.
std::vector<Expr> leaves_of(const Problem& problem);
/// The value of leaf i of that list.
double entry_of(const Point& point, std::size_t i);
/// Where the run begins; 0 for leaves without a value.
Point start_point(const Problem& problem, const Simulation& simulation);
/// Time, parameters and inputs of a start in the middle of the run.
void set_conditions(const Simulation& simulation, double t, dae::StartRequest& request);

/// The leaves of a model, in the order x, x′, z, as expressions of another model; `open`: leaves that it does
/// not contain, which have no value there.
struct Meanings {
  std::vector<Expr> expressions;
  std::vector<Eigen::Index> open;
};

/// A part of the trajectory.
struct RunPart {
  dae::ModelPtr model;
  SolutionPtr solution;
  double from = 0;
  bool may_jump = false;  ///< its first point is part of the solution, where it is another one than the last
  std::vector<char> deferred;  ///< by event: where it stops the part, the caller records it
};

/// Times between saved points are asked of the piece they belong to.
class RunParts : public Continuation {
 public:
  /// The leaves of the problem, in the order x, x′, z, that all pieces can express.
  RunParts(std::vector<Expr> leaves, int states, const Substitution& inputs)
      : n_(states), leaves_(std::move(leaves)), inputs_(inputs) {}

  void add(RunPart piece);
  const RunPart& last() const { return pieces_.back(); }
  bool empty() const { return pieces_.empty(); }
  bool is_one() const { return pieces_.size() == 1; }
  const std::vector<Expr>& leaves() const { return leaves_; }
  /// A point of the last piece in the unknowns of the first model.
  Point translated(const Point& point) const;
  /// The same of a model that is not yet a piece, by values of the expressions.
  Meanings meanings_in(const dae::Model& model, const std::vector<Expr>& known) const;
  Point with_values(double t, Vec values, const Meanings& meanings) const;

  std::pair<double, double> interval(const Points& saved) const override;
  Point at(const Points&, double t) override;
  double errors_beyond_estimates() override;
  std::optional<double> passed_growth() override;

 private:
  int n_;
  std::vector<Expr> leaves_;
  Substitution inputs_;
  std::vector<RunPart> pieces_;
  std::vector<Meanings> meanings_;  ///< of every piece
};

/// Collects pieces into a solution in the unknowns of the model that the run was asked for.
class SolutionInParts {
 public:
  /// leaves: of the problem of `model`, see RunParts.
  SolutionInParts(dae::ModelPtr model, const Simulation& simulation, std::vector<Expr> leaves);

  const Problem& problem() const { return *problem_; }
  RunParts& pieces() { return *pieces_; }
  const std::vector<Expr>& leaves() const { return pieces_->leaves(); }
  Solution& solution() { return *merged_; }
  const Stats& stats() const { return stats_; }
  /// The tolerances of the run for a part with other states; a state that has become a derivative has none.
  ToleranceRequest tolerances_in(const dae::ModelPtr& part, const ToleranceRequest& asked) const;
  /// stop_when of a part: `own`, or that of the caller's plan, to whose unknowns points are translated.
  std::function<bool(const Point&)> stop_when(const dae::ModelPtr& part,
                                              std::function<bool(const Point&)> own);
  /// Does a part that starts there continue the last one, in the states of the first model? Nearly
  /// dependent rows may have another solution nearby. True where there is no part yet. A state may differ
  /// by a hundredth of itself plus a million tolerances, but by no more than a hundredth of its usual
  /// size, as the tolerances imply it.
  bool continues_at(const dae::ConsistentState& start) const;
  /// Has the caller's plan ended the last part?
  bool is_stopped() const { return stopped_; }
  /// Events with numbers from `shown` on are not the user's. The end of a part belongs to the next one.
  void add(RunPart piece, std::size_t shown);
  TrajectoryPtr finish(const RunOutcome& outcome);

 private:
  double rounding_of_times() const;
  void save_times(double end);

  dae::ModelPtr model_;
  const Simulation& simulation_;
  ProblemPtr problem_;
  std::shared_ptr<RunParts> pieces_;
  std::shared_ptr<Solution> merged_;
  std::vector<double> times_;
  std::size_t next_time_ = 0;
  Stats stats_;
  double seconds_ = 0;
  bool stopped_ = false;
};

}  // namespace pendula::integrate
