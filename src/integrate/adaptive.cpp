#include "integrate/adaptive.hpp"

#include <chrono>
#include <cmath>
#include <ctime>
#include <deque>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/print.hpp"
#include "integrate/methods.hpp"
#include "integrate/trail.hpp"

namespace pendula::integrate {

#if defined(__SSE__)
FlushDenormals::FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); }  // FTZ | DAZ
FlushDenormals::~FlushDenormals() { _mm_setcsr(before_); }
#else
FlushDenormals::FlushDenormals() : before_(0) {}
FlushDenormals::~FlushDenormals() = default;
#endif

namespace {

/// Saves mesh points, or the requested times.
class Saver {
 public:
  Saver(Solution& solution, const Plan& plan)
      : solution_(solution),
        plan_(plan),
        rounding_(4 * std::numeric_limits<double>::epsilon() *
                  std::max(std::fabs(plan.from), std::fabs(plan.to))) {}

  void begin(const Point& point) {
    if (!plan_.times) return solution_.save(point);
    if (next_ < plan_.times->size() && (*plan_.times)[next_] <= point.t + rounding_) save(point);
  }
  /// `open`: the end of the step is about to jump, its time belongs to the point after.
  void step(Stepper& stepper, const StepView& view, const Point& end, bool open) {
    if (!plan_.times) return solution_.save(end);
    for (; next_ < plan_.times->size();) {
      const double t = (*plan_.times)[next_];
      if (t > end.t + rounding_ || (open && t >= end.t - rounding_)) return;
      if (t >= end.t - rounding_) {
        save(end);
        continue;
      }
      stepper.interpolate(view, t, Detail::full, between_);
      save(between_);
    }
  }

 private:
  void save(const Point& point) {
    asked_ = point;
    asked_.t = (*plan_.times)[next_++];  // the time as it was asked for
    solution_.save(asked_);
  }
  Solution& solution_;
  const Plan& plan_;
  double rounding_;
  std::size_t next_ = 0;
  Point between_, asked_;
};

/// Restarts that follow each other at shrinking distances: no time passes any more.
class Accumulation {
 public:
  /// True when there is no end of it. `steps`: taken so far.
  bool add(double t, long steps, double span) {
    quick_ = steps - last_steps_ <= 2 ? quick_ + 1 : 0;
    last_steps_ = steps;
    if (quick_ == 0) since_ = t;
    if (quick_ >= 40 && t - since_ < 1e-4 * span) return true;
    times_.push_back(t);
    if (times_.size() <= many) return false;
    times_.pop_front();
    return times_.back() - times_.front() < 1e-8 * span;
  }

 private:
  static constexpr std::size_t many = 12;
  std::deque<double> times_;
  int quick_ = 0;
  long last_steps_ = 0;
  double since_ = 0;
};

class Run {
 public:
  Run(ProblemPtr problem, const Method& method, const Plan& plan)
      : problem_(std::move(problem)),
        method_(method),
        plan_(plan),
        trail_(std::make_shared<Trail>(problem_->n(), problem_->m())),
        solution_(std::make_shared<Solution>(problem_)),
        saver_(*solution_, plan),
        finder_(problem_, plan.events.list) {
    if (plan_.tolerances.rtol.size() == 0)
      plan_.tolerances = Tolerances::uniform(problem_->n() + problem_->m(), 1e-6, 1e-9);
    solution_->set_continuation(trail_);
  }

  std::shared_ptr<Solution> solution() { return solution_; }

  void start(Point point) {
    try {
      const Choice choice = method_.family == "auto" ? choose(problem_, method_, plan_, point)
                                                     : Choice{method_.family, method_.tableau};
      method_.tableau = choice.tableau;
      use(choice.family, point);
    } catch (const Failure& failure) {
      throw Failure(text("at the start, t = ", rounded(point.t, 6), ": ", failure.what()));
    }
    trail_->begin(stepper().here());
    saver_.begin(stepper().here());
    finder_.start(stepper().here());
  }

  void go() {
    const std::clock_t begin = std::clock();
    std::string status;
    try {
      while (status.empty()) status = advance();
    } catch (const Interrupted&) {
      status = "interrupted";
    } catch (const Failure& failure) {
      status = text("stopped at t = ", rounded(reached_, 6), ": ", failure.what());
    }
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    solution_->finish(status, trail_->stats, seconds);
  }

 private:
  Stepper& stepper() { return trail_->stepper(); }

  void use(const std::string& family, const Point& point) {
    trail_->use(make_stepper(family, problem_, method_, plan_, trail_->stats));
    stepper().start(point, plan_.to);
    name_ += (name_.empty() ? "" : ", then ") + stepper().name();
    solution_->set_method(name_, 0);
    reached_ = point.t;
  }

  /// One step with everything that happens in it; the status when the run is over.
  std::string advance() {
    poll_interrupt();
    if (trail_->stats.steps >= plan_.most_steps)
      throw Failure(text("max_steps = ", plan_.most_steps, " steps were not enough"));
    tell_progress();
    view_.record = nullptr;
    stepper().step(plan_.to);
    const std::size_t size = stepper().record_size();
    record_.resize(size);
    stepper().record(record_.data());
    view_.record = record_.data();
    if (!finder_.empty() || plan_.times) view_.from = stepper().before(), view_.to = stepper().here();
    for (;;) {
      const auto hit = finder_.find(stepper(), view_);
      if (!hit) break;
      std::string status;
      if (handle(*hit, status)) return status;
    }
    keep(stepper().here(), false);
    if (stepper().here().t >= plan_.to) return "finished";
    if (plan_.leave && plan_.leave(stepper().here())) return "left";
    change_if_stiff();
    return "";
  }

  void keep(const Point& end, bool open) {
    trail_->step_to(end, record_);
    saver_.step(stepper(), view_, end, open);
    reached_ = end.t;
  }

  /// True when the step ends at the event.
  bool handle(const EventFinder::Hit& hit, std::string& status) {
    const Event& event = plan_.events.list[static_cast<std::size_t>(hit.which)];
    Point point;
    point.xdot = view_.to.xdot, point.z = view_.to.z;
    stepper().interpolate(view_, event.surface ? hit.before : hit.t, Detail::full, point);
    point.t = hit.t;
    if (event.surface) {
      keep(point, false);
      restart(point, event);
      return true;
    }
    const bool may_jump = event.call || !event.reset.empty();
    keep(point, may_jump);
    EventReply reply;
    if (event.call) reply = event.call(point);
    for (const auto& [state, value] : event.reset)
      reply.reset.emplace_back(state, solution_->values({&value, 1}, point)[0]);
    reply.stop = reply.stop || event.stop;
    EventRecord record{hit.t, hit.which,
                       reply.stop            ? "stop"
                       : reply.reset.empty() ? ""
                                             : "reset",
                       point, point};
    if (!reply.reset.empty()) {
      reset(point, reply.reset);
      if (!reply.stop) restart(point, event);
      record.after = reply.stop ? point : stepper().here();
      trail_->begin(record.after);
      saver_.begin(record.after);
    } else if (may_jump && plan_.times) {
      saver_.begin(point);  // it did not
    }
    solution_->add_event(record);
    if (reply.stop || (!reply.reset.empty() && hit.t >= plan_.to)) status = reply.stop ? "event" : "finished";
    if (reply.reset.empty() && !reply.stop) finder_.pass(hit, stepper(), view_);
    return reply.stop || !reply.reset.empty();
  }

  void reset(Point& point, const std::vector<std::pair<Expr, double>>& values) {
    std::vector<int> changed;
    for (const auto& [state, value] : values) {
      const auto& x = problem_->model().x;
      const auto at = std::find(x.begin(), x.end(), state);
      if (at == x.end())
        throw Error(text("an event cannot reset ", to_text(state), ": it is not a state of the model"));
      if (!std::isfinite(value)) throw Failure(text("an event resets ", to_text(state), " to ", value));
      changed.push_back(static_cast<int>(at - x.begin()));
      point.x[changed.back()] = value;
    }
    if (plan_.events.reinitialise) plan_.events.reinitialise(point, changed);
  }

  void restart(const Point& point, const Event& event) {
    const double span = plan_.to - plan_.from;
    if (accumulation_.add(point.t, trail_->stats.steps, span)) {
      reached_ = point.t;
      throw Failure(
          event.surface
              ? text("chattering: the solution crosses ", to_text(event.when),
                     " = 0 again and again and slides along it. Regularise the equations there, for "
                     "example tanh(s/1e-3) in place of sign(s)")
              : text("the events ", to_text(event.when),
                     " = 0 accumulate: infinitely many in finite time (Zeno). Add an event that "
                     "stops, or a reset that ends the motion"));
    }
    stepper().start(point, plan_.to);
    finder_.start(stepper().here());
  }

  /// Explicit → Radau IIA, when it pays: many more steps of this size would follow.
  void change_if_stiff() {
    if (method_.family != "auto" || !stepper().is_stiff()) return;
    if ((plan_.to - stepper().here().t) < 100 * stepper().next_dt()) return;
    const Point here = stepper().here();
    const double first = plan_.dt_first;
    plan_.dt_first = stepper().next_dt();
    use("radau", here);
    plan_.dt_first = first;
  }

  void tell_progress() {
    if (!plan_.progress || ++since_told_ < 32) return;
    since_told_ = 0;
    plan_.progress(reached_, trail_->stats);
  }

  ProblemPtr problem_;
  Method method_;
  Plan plan_;
  std::shared_ptr<Trail> trail_;
  std::shared_ptr<Solution> solution_;
  Saver saver_;
  EventFinder finder_;
  Accumulation accumulation_;
  StepView view_;
  std::vector<double> record_;
  std::string name_;
  double reached_ = 0;
  int since_told_ = 0;
};

void check_adaptive(const Plan& plan) {
  check_interval(plan);
  const auto positive = [](const char* name, double value) {
    if (!(value > 0))
      throw Error(text(name, " = ", rounded(value), "; a tolerance must be a positive number, for example ",
                       name, " = 1e-8"));
  };
  for (double r : plan.tolerances.rtol) {
    if (!(r >= 0) || !std::isfinite(r)) positive("rtol", r);
    if (r != 0 && r < 1e-14)
      throw Error(text("rtol = ", rounded(r, 3), " is below what double precision can reach; 1e-13 is about ",
                       "the smallest that makes sense"));
  }
  for (Eigen::Index i = 0; i < plan.tolerances.atol.size(); ++i) {
    const double a = plan.tolerances.atol[i];
    if (!(a >= 0) || !std::isfinite(a)) positive("atol", a);
    if (a == 0 && plan.tolerances.rtol[i] == 0) positive("rtol", 0);
  }
  if (!(plan.dt_max > 0)) throw Error(text("dtmax = ", rounded(plan.dt_max), " must be a positive number"));
  if (!(plan.dt_first >= 0) || !std::isfinite(plan.dt_first))
    throw Error(text("dt0 = ", rounded(plan.dt_first), " must be a positive number"));
  if (plan.most_steps < 1) throw Error(text("max_steps = ", plan.most_steps, " must be at least 1"));
}

}  // namespace

SolutionPtr integrate_adaptive(ProblemPtr problem, const Method& method, Point start, const Plan& plan,
                               const std::function<void(SolutionPtr)>& watch) {
  check_adaptive(plan);
  check_start(start, *problem);
  start.t = plan.from;
  if (start.xdot.size() == 0) start.xdot = Vec::Zero(problem->n());
  if (start.z.size() == 0) start.z = Vec::Zero(problem->m());
  problem->accelerate();
  const FlushDenormals guard;
  Run run(problem, method, plan);
  if (watch) watch(run.solution());
  run.start(start);
  run.go();
  return run.solution();
}

}  // namespace pendula::integrate
