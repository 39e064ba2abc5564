#include "integrate/run/adaptive_run.hpp"

#include <chrono>
#include <cmath>
#include <ctime>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/jumps.hpp"
#include "integrate/event/monitor/rank_monitor.hpp"
#include "integrate/event/monitor/singularity_monitor.hpp"
#include "integrate/event/monitor/tangency_monitor.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/run/output.hpp"
#include "integrate/run/step_history.hpp"
#include "integrate/step/explicit_stepper.hpp"

namespace pendula::integrate {

#if defined(__SSE__)
FlushDenormals::FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); }  // FTZ | DAZ
FlushDenormals::~FlushDenormals() { _mm_setcsr(before_); }
#else
FlushDenormals::FlushDenormals() : before_(0) {}
FlushDenormals::~FlushDenormals() = default;
#endif

namespace {

class Run {
 public:
  Run(ProblemPtr problem, const Method& method, const Plan& plan)
      : problem_(std::move(problem)),
        method_(method),
        plan_(plan),
        trail_(std::make_shared<Trail>(problem_->n(), problem_->m())),
        solution_(std::make_shared<Solution>(problem_)),
        saver_(*solution_, plan),
        finder_(problem_, plan.events.list),
        couplings_(Couplings::of(*problem_, plan.modes)),
        ranks_(problem_, plan_.blocks, plan.tolerances.rtol.size() ? plan.tolerances.rtol.minCoeff() : 1e-6),
        roots_(problem_, plan_.guards),
        touches_(problem_, plan_.events.list) {
    if (plan_.tolerances.rtol.size() == 0)
      plan_.tolerances = Tolerances::uniform(problem_->n() + problem_->m(), 1e-6, 1e-9);
    if (plan_.times) trail_->may_forget();
    solution_->set_continuation(trail_);
  }

  std::shared_ptr<Solution> solution() { return solution_; }

  void start(Point point) {
    aim(point.t);
    try {
      if (plan_.modes > 0) {
        finder_.start(point);
        set_modes(point, {});
      }
      const Choice choice = method_.family == "auto" ? choose(problem_, method_, plan_, point, couplings_)
                                                     : Choice{method_.family, method_.tableau, ""};
      method_.tableau = choice.tableau;
      use(choice.family, point, choice.why);
      begin(point, {});
    } catch (const Failure& failure) {
      throw Failure(text("at the start, t = ", rounded(point.t, 6), ": ", failure.what()));
    }
    trail_->begin(stepper().here());
    saver_.begin(stepper().here());
    if (!plan_.guards.empty() || !plan_.blocks.empty()) first_ = stepper().here();
    ranks_.start(first_);
    roots_.start(first_);
    looked_ = first_;
  }

  void go() {
    const std::clock_t begin = std::clock();
    std::string status;
    try {
      while (status.empty()) status = advance();
    } catch (const Interrupted&) {
      status = "interrupted";
    } catch (const Failure& failure) {
      status = text("stopped at t = ", rounded(reached_, 6), ": ", failure.what(), near_singularity());
    }
    problem_->set_limit(std::numeric_limits<double>::infinity());
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    solution_->finish(status, trail_->stats, seconds);
  }

 private:
  Stepper& stepper() { return trail_->stepper(); }

  void use(const std::string& family, const Point& point, const std::string& why) {
    trail_->use(make_stepper(family, problem_, method_, plan_, trail_->stats, couplings_));
    stepper().start(point, end_);
    name_ += (name_.empty() ? "" : ", then ") + stepper().name();
    solution_->set_method(name_, 0);
    if (!why.empty()) solution_->add_method({point.t, stepper().name(), why});
    reached_ = point.t;
  }

  /// One step with everything that happens in it; the status when the run is over.
  std::string advance() {
    poll_interrupt();
    if (trail_->stats.steps >= plan_.most_steps)
      throw Failure(text("max_steps = ", plan_.most_steps, " steps were not enough",
                         stepper().is_stiff()
                             ? ". They are limited by stability: the equations are stiff, take "
                               "method = \"radau\" or \"bdf\""
                             : ""));
    leave_crawl();
    tell_progress();
    view_.record = nullptr;
    step();
    if (!plan_.watched.empty() && repeated_up_to_jump()) return "";
    const std::size_t size = stepper().record_size();
    record_.resize(size);
    stepper().record(record_.data());
    view_.record = record_.data();
    if (!finder_.empty() || saver_.wants(stepper().here().t))
      view_.from = stepper().before(), view_.to = stepper().here();
    for (quiet_ = true; !finder_.empty(); quiet_ = false) {
      std::optional<EventFinder::Hit> hit;
      try {
        hit = finder_.find(stepper(), view_);
      } catch (const Failure&) {  // no z inside the step: it has passed a point where equations are singular
        if (plan_.guards.empty() || !quiet_ || !repeated_shorter()) throw;
        return "";
      }
      if (!hit) break;
      std::string status;
      if (handle(*hit, status)) return status;
    }
    keep(stepper().here(), false);
    const bool done = stepper().here().t >= plan_.to;
    if (std::string status = look_at_ranks(done); !status.empty()) return status;
    if (std::string status = look_at_touches(); !status.empty()) return status;
    if (done) return "finished";
    if (stepper().here().t >= end_) return pass_break();
    if (plan_.modes > 0 && modes_differ()) begin_again(Point(stepper().here()), {});
    if (plan_.leave && plan_.leave(stepper().here())) return "left";
    change_if_stiff();
    return "";
  }

  /// Steps of which more than half are rejected, thousand after thousand, where something the equations need
  /// has all but vanished: an explicit method would creep along the singular points to the end of time.
  void leave_crawl() {
    constexpr long often = 2000;
    constexpr double vanished = 1e-6;
    const Stats& stats = trail_->stats;
    if (plan_.guards.empty() || stats.steps < looked_steps_ + often) return;
    const double t = stepper().here().t;
    const bool still = t - looked_t_ < 1e-6 * (plan_.to - plan_.from);
    const bool struggling = still || stats.rejected - looked_rejected_ > often / 2;
    looked_steps_ = stats.steps, looked_rejected_ = stats.rejected, looked_t_ = t;
    if (struggling && !near_singularity(vanished).empty())
      throw Failure("the steps have become so small that they lead nowhere");
  }

  /// A step over a jump of an input is taken back; the next ones end there.
  bool repeated_up_to_jump() {
    const double from = stepper().before().t, to = stepper().here().t;
    const double last = to >= end_ ? std::nextafter(to, from) : to;
    std::optional<double> first;
    for (const auto& input : plan_.watched)
      if (const auto t = find_jump(input, from, last); t && (!first || *t < *first)) first = t;
    if (!first || *first <= from) return false;
    --trail_->stats.steps, ++trail_->stats.rejected;
    const Point start = stepper().before();
    end_ = *first;
    problem_->set_limit(end_);
    finder_.set_limit(end_);
    stepper().start(start, end_);
    return true;
  }

  /// The step is taken back, for one of a quarter of its length. False where that leads nowhere, or where x′
  /// and z solve the equations on another branch when asked again: behind the singular point.
  bool repeated_shorter() {
    const Point start = stepper().before();
    const double dt = (stepper().here().t - start.t) / 4;
    if (dt < 1e-10 * (plan_.to - plan_.from)) return false;
    --trail_->stats.steps, ++trail_->stats.rejected;
    stepper().suggest(dt);
    stepper().start(start, end_);
    stepper().suggest(0);
    std::vector<double> sides;
    for (std::size_t i = 0; i < plan_.events.list.size(); ++i)
      sides.push_back(finder_.side(static_cast<int>(i)));
    finder_.start(stepper().here());
    for (std::size_t i = 0; i < sides.size(); ++i)
      if (!plan_.events.list[i].ends.empty() && sides[i] * finder_.side(static_cast<int>(i)) < 0)
        return false;
    return true;
  }

  /// Goes on behind a time at which inputs are not smooth, with steps of the size they had.
  std::string pass_break() {
    const Point here = stepper().here();
    aim(here.t);
    stepper().suggest(stepper().next_dt());
    begin_again(here, {});
    stepper().suggest(0);
    return "";
  }

  /// The next step ends at `to` or where inputs are not smooth.
  void aim(double t) {
    const auto next = std::upper_bound(plan_.breaks.begin(), plan_.breaks.end(), t);
    const bool inside = next != plan_.breaks.end() && *next < plan_.to;
    end_ = inside ? *next : plan_.to;
    const double limit = next == plan_.breaks.end() ? std::numeric_limits<double>::infinity() : *next;
    problem_->set_limit(limit);
    finder_.set_limit(limit);
  }

  void keep(const Point& end, bool open) {
    trail_->step_to(end, record_);
    saver_.step(stepper(), view_, end, open);
    reached_ = end.t;
  }

  /// True when the step ends at the event.
  bool handle(const EventFinder::Hit& hit, std::string& status) {
    const auto event_of = [&](const EventFinder::Crossing& c) -> const Event& {
      return plan_.events.list[c.which];
    };
    bool surface = false, may_jump = false;
    for (const auto& crossing : hit.list) {
      const Event& event = event_of(crossing);
      if (!event.ends.empty()) {
        // values inside a step over a singular point mean little: come nearer
        if (quiet_ && view_.to.t - view_.from.t > 1e-6 * (plan_.to - plan_.from) && repeated_shorter())
          return true;
        return end_before(hit, event, status);
      }
      surface = surface || event.surface;
      may_jump = may_jump || event.call || !event.reset.empty();
    }
    Point point;
    point.xdot = view_.to.xdot, point.z = view_.to.z;
    const bool frozen = plan_.modes > 0;
    stepper().interpolate(view_, surface && !frozen ? hit.before : hit.t, Detail::full, point);
    point.t = hit.t;
    keep(point, may_jump);
    const Point before = point;
    bool stop = false, changed = false;
    for (const auto& crossing : hit.list) {
      if (event_of(crossing).surface) continue;
      const EventReply reply = apply(event_of(crossing), crossing.which, point);
      stop = stop || reply.stop, changed = changed || !reply.reset.empty();
    }
    if (changed || surface) {
      if (!stop) restart(point, before, hit);
      if (changed) {
        if (!stop) point = stepper().here();
        trail_->begin(point);
        saver_.begin(point);
      }
    }
    if (may_jump && !changed && plan_.times) saver_.begin(point);  // it did not
    for (EventRecord& record : records_) {
      if (record.action == "reset") record.after = point;
      solution_->add_event(record);
    }
    records_.clear();
    if (stop || (changed && hit.t >= plan_.to)) status = stop ? "event" : "finished";
    if (!changed && !surface && !stop) finder_.pass(hit, stepper(), view_);
    return stop || changed || surface;
  }

  /// The equations cannot be solved where this event is: the run ends where the step to it began, or, where
  /// other events have been in the step, just before it.
  bool end_before(const EventFinder::Hit& hit, const Event& event, std::string& status) {
    if (!quiet_) {
      Point point;
      point.xdot = view_.to.xdot, point.z = view_.to.z;
      stepper().interpolate(view_, hit.before, Detail::state, point);
      point.t = hit.before;
      keep(point, false);
    }
    status = text("stopped at t = ", rounded(hit.t, 6), ": ", event.ends);
    return true;
  }

  /// Every few steps: where a block has lost its rank since, the run ends before it. Between looks that are
  /// not remembered step by step: cubic Hermite interpolation.
  std::string look_at_ranks(bool last) {
    const Point& here = stepper().here();
    const auto hit = ranks_.after(here, last, trail_->stats, [&](double t, Point& out) {
      if (!trail_->has_forgotten()) return trail_->sketch(t, out);
      between(looked_, here, (t - looked_.t) / (here.t - looked_.t), out);
    });
    if (hit) {
      reached_ = trail_->has_forgotten() ? looked_.t : trail_->cut(hit->t);
      solution_->cut(reached_);
      return text("stopped at t = ", rounded(hit->t, 6), ": ", hit->reason);
    }
    if (ranks_.just_looked() && plan_.times) looked_ = here;
    if (const auto root = roots_.after(here)) {
      reached_ = trail_->has_forgotten() ? root->t : trail_->cut(root->t);
      solution_->cut(reached_);
      return text("stopped at t = ", rounded(root->t, 6), ": ", root->reason);
    }
    return "";
  }

  std::string look_at_touches() {
    if (plan_.guards.empty()) return "";
    const Point& before = stepper().before();
    const auto hit = touches_.after(finder_.values(), before, plan_.tolerances);
    if (!hit) return "";
    reached_ = trail_->has_forgotten() ? before.t : trail_->cut(before.t);
    solution_->cut(reached_);
    const Event& event = plan_.events.list[hit->which];
    return text("stopped at t = ", rounded(before.t, 6), ": within the tolerances (",
                rounded(hit->distance, 1), ") ", event.ends,
                "; if the solution only comes near, ask for smaller tolerances or go on with guards = false");
  }

  /// After a failure: what the equations need and is almost zero at the last point.
  std::string near_singularity(double almost = 0.05) {
    GuardWatch watch(problem_, plan_);
    watch.start(first_);
    const bool back = solution_->size() > 0 && reached_ < stepper().here().t;
    return watch.almost_zero(back ? stepper().before() : stepper().here(), almost);
  }

  /// What an event asks for, done to the point.
  EventReply apply(const Event& event, int which, Point& point) {
    EventReply reply;
    if (event.call) reply = event.call(point);
    for (const auto& [state, value] : event.reset)
      reply.reset.emplace_back(state, solution_->values({&value, 1}, point)[0]);
    reply.stop = reply.stop || event.stop;
    const char* action = reply.stop ? "stop" : reply.reset.empty() ? "" : "reset";
    records_.push_back({point.t, which, action, point, point});
    if (!reply.reset.empty()) reset(point, reply.reset);
    return reply;
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

  void restart(const Point& point, const Point& before, const EventFinder::Hit& hit) {
    ++since_event_;
    for (const EventFinder::Crossing& crossing : hit.list)
      if (const Event& e = plan_.events.list[crossing.which]; !e.surface)
        since_event_ = 0, last_event_ = crossing.which;
    // Between the bounces of v′ = -g - v |v| the solution crosses v = 0: the bounces are what accumulates.
    const int which = last_event_ >= 0 && since_event_ <= 2 ? last_event_ : hit.list.front().which;
    const Event& event = plan_.events.list[which];
    if (accumulation_.add(point.t, trail_->stats.steps, plan_.to - plan_.from)) {
      reached_ = point.t;
      if (event.surface) throw sliding(event);
      throw Failure(
          text("the events ", to_text(event.when),
               " = 0 accumulate: infinitely many in finite time (Zeno). Add an event that stops, or "
               "a reset that ends the motion"));
    }
    begin_again(point, hit.list);
    if (problem_->n() > problem_->shown_n()) follow_sensitivities(before, hit);
  }

  /// Begins anew where the equations or the point have jumped.
  void begin_again(const Point& point, const std::vector<EventFinder::Crossing>& crossed) {
    begin(point, crossed);
    touches_.forget();
    if (plan_.modes > 0 || !plan_.breaks.empty() || !plan_.watched.empty()) trail_->begin(stepper().here());
  }

  /// The time t* of an event depends on p: dt*/dp = -(dg/dp)/(dg/dt), and with it S jumps where x or x′ do:
  /// S₊ = S₋ + (x′₋ - x′₊) dt*/dp, for a reset x₊ = r(t, x): S₊ = dr/dp + (dr/dt - x′₊) dt*/dp.
  /// Galán, Feehery & Barton, Appl. Numer. Math. 31, 1999.
  void follow_sensitivities(const Point& before, const EventFinder::Hit& hit) {
    const Event& event = plan_.events.list[hit.list.front().which];
    const Vec tangent = solution_->values(event.tangent, before);
    const double slope = finder_.slope(hit.list.front().which, before);
    if (slope == 0)
      throw Failure(
          text("the solution grazes ", to_text(event.when), " = 0: it is not differentiable there"));
    Point after = stepper().here();
    const int n = problem_->shown_n();
    for (Eigen::Index j = 0; j < tangent.size(); ++j) {
      const double shift = -tangent[j] / slope;
      const auto block = static_cast<Eigen::Index>(n) * (j + 1);
      after.x.segment(block, n) =
          before.x.segment(block, n) + shift * (before.xdot.head(n) - after.xdot.head(n));
      for (std::size_t r = 0; r < event.reset.size(); ++r) {
        const auto& x = problem_->model().x;
        const auto i = std::find(x.begin(), x.end(), event.reset[r].first) - x.begin();
        const Vec rates = solution_->values(event.reset_tangent[r], before);
        after.x[block + i] = rates[j] + shift * (rates[rates.size() - 1] - after.xdot[i]);
      }
    }
    begin_again(after, hit.list);
  }

  static Failure sliding(const Event& event) {
    return Failure(
        text("chattering: the solution crosses ", to_text(event.when),
             " = 0 again and again and slides along it. Regularise the equations there, for example "
             "tanh(s/1e-3) in place of sign(s)"));
  }

  // ── modes of piecewise equations ──

  /// The stepper and the events begin at a point, in the modes of the side on which the solution goes on.
  void begin(const Point& point, const std::vector<EventFinder::Crossing>& crossed) {
    if (point.t >= end_) aim(point.t);
    if (plan_.modes == 0) {
      stepper().start(point, end_);
      finder_.start(stepper().here());
      return;
    }
    finder_.start(point);
    int changed = -1;
    for (std::size_t k = 0; k < 2 * plan_.events.list.size() + 2; ++k) {
      changed = set_modes(k == 0 ? point : Point(stepper().here()), crossed);
      if (k > 0 && changed < 0) return;
      stepper().start(point, end_);
      finder_.start(stepper().here());
    }
    reached_ = point.t;
    throw sliding(plan_.events.list[changed]);
  }

  /// The side on which a solution goes on that is on a surface without a slope: where x″ takes it.
  double side_ahead(int which, const Point& point) {
    if (!derivative_) derivative_ = std::make_unique<Derivative>(problem_, trail_->stats);
    Point ahead = point;
    if (!(*derivative_)(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data())) return 0;
    const double dt = 1e-6 * (plan_.to - plan_.from);
    ahead.t += dt, ahead.x += dt * ahead.xdot;
    if (!(*derivative_)(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data())) return 0;
    const double slope = finder_.slope(which, ahead);
    return (slope > 0) - (slope < 0);
  }

  /// Writes the modes of all sides into the problem; which surface has changed its mode, or -1.
  int set_modes(const Point& point, const std::vector<EventFinder::Crossing>& crossed) {
    std::vector<double> sides(plan_.events.list.size(), 0.0);
    for (std::size_t i = 0; i < sides.size(); ++i) sides[i] = finder_.side(static_cast<int>(i));
    for (const auto& crossing : crossed)
      if (double& side = sides[crossing.which]; side == 0) side = crossing.rising ? 1 : -1;
    const std::vector<double> modes = modes_;
    use_modes(sides);
    for (std::size_t i = 0; i < sides.size(); ++i)
      if (sides[i] == 0 && !plan_.events.list[i].modes.empty())
        sides[i] = side_ahead(static_cast<int>(i), point);
    use_modes(sides);
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (const Mode& mode : plan_.events.list[i].modes) {
        const auto m = static_cast<std::size_t>(mode.number);
        if (modes.empty() || modes_[m] != modes[m]) return static_cast<int>(i);
      }
    return -1;
  }

  void use_modes(const std::vector<double>& sides) {
    modes_.resize(static_cast<std::size_t>(plan_.modes));
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (const Mode& mode : plan_.events.list[i].modes) modes_[mode.number] = mode.value(sides[i]);
    trail_->use_modes(problem_, modes_);
  }

  /// After a step without events: a crossing was not seen, or the solution has left a surface it was on.
  bool modes_differ() const {
    for (int i = 0; i < static_cast<int>(plan_.events.list.size()); ++i)
      for (const Mode& mode : plan_.events.list[i].modes)
        if (finder_.side(i) != 0 && mode.value(finder_.side(i)) != modes_[mode.number]) return true;
    return false;
  }

  /// Explicit → implicit, when it pays: many more steps of this size would follow.
  void change_if_stiff() {
    if (method_.family != "auto" || problem_->has_dense_jacobian() || !stepper().is_stiff()) return;
    const double worth = 100 * implicit_cost(problem_->n() + problem_->m());
    if ((plan_.to - stepper().here().t) < worth * stepper().next_dt()) return;
    change(implicit_family(*problem_, method_, plan_), stepper().next_dt(),
           "stiff: stability, not accuracy, limited the steps");
  }

  /// Goes on with an implicit method from here.
  void change(const std::string& family, double dt, const std::string& why) {
    const Point here = stepper().here();
    const double first = plan_.dt_first;
    plan_.dt_first = dt;
    use(family, here, why);
    plan_.dt_first = first;
  }

  /// One step; where an explicit method that was chosen cannot go on, an implicit one may.
  void step() {
    try {
      return stepper().step(end_);
    } catch (const Failure& failure) {
      if (method_.family != "auto" || dynamic_cast<ExplicitStepper*>(&stepper()) == nullptr) throw;
      const std::string reason = failure.what();
      const std::string name = name_;
      const std::size_t uses = solution_->methods_in_use().size();
      try {
        change("radau", 0, "the explicit method could not go on");
        stepper().step(end_);
      } catch (const Failure&) {
        solution_->keep_methods(uses);
        solution_->set_method(name_ = name, 0);
        throw Failure(reason);
      }
    }
  }

  void tell_progress() {
    if (!plan_.progress || ++since_told_ < 8) return;
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
  Point first_, looked_;
  bool quiet_ = true;                           ///< no event so far in the step
  std::shared_ptr<const Couplings> couplings_;  ///< of a large model
  RankWatch ranks_;
  RootWatch roots_;
  TouchWatch touches_;
  Accumulation accumulation_;
  int last_event_ = -1, since_event_ = 0;  ///< the user's last event; restarts since then
  StepView view_;
  std::vector<double> record_;
  std::string name_;
  std::vector<EventRecord> records_;  ///< of the events at one time
  std::vector<double> modes_;
  std::unique_ptr<Derivative> derivative_;
  double reached_ = 0;
  double end_ = 0;  ///< of the next step at the latest
  int since_told_ = 0;
  long looked_steps_ = 0, looked_rejected_ = 0;
  double looked_t_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

SolutionPtr integrate_adaptive(ProblemPtr problem, const Method& method, Point start, const Plan& plan,
                               const std::function<void(SolutionPtr)>& watch) {
  check_adaptive(plan);
  start = checked_start(std::move(start), *problem, plan.from);
  problem->accelerate();
  const FlushDenormals guard;
  Run run(problem, method, plan);
  if (watch) watch(run.solution());
  run.start(start);
  run.go();
  return run.solution();
}

}  // namespace pendula::integrate
