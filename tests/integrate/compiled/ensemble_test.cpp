// Many sets on SIMD lanes: a set's result depends on nothing but the set.
#include "integrate/sweep/ensemble.hpp"
#include "integrate/run/methods.hpp"

#include <cmath>
#include <map>
#include <optional>

#include <doctest/doctest.h>

#include "base/interrupt.hpp"
#include "dae/model/first_order.hpp"
#include "integrate/run/adaptive_run.hpp"
#include "tests/integrate/problems.hpp"
#include "tests/require_code.hpp"

namespace pendula::ensemble_test {

using namespace pendula::test;
using namespace pendula::integrate;

namespace {

Expr x() { return variable("x"); }
Expr y() { return variable("y"); }
Expr k() { return symbol(Kind::parameter, "k"); }

/// x′ = y, y′ = -k sin x + cos(3t)/10: functions of a state and of time.
dae::FirstOrder swing() {
  dae::FirstOrder form = ode({x(), y()}, {y(), -k() * sin(x()) + cos(3 * time_symbol()) / 10});
  form.p = {k()};
  return form;
}

/// Bogacki & Shampine's pair, orders 3 and 2, FSAL.
TableauPtr pair32() {
  return drawn("0 | \n 1/2 | 1/2 \n 3/4 | 0 3/4 \n 1 | 2/9 1/3 4/9 \n | 2/9 1/3 4/9 0 \n | 7/24 1/4 1/3 1/8");
}

struct Result {
  std::vector<double> numbers;  ///< t, x, y of every point
  bool finished = false, abandoned = false;
  Stats stats;
};

class List : public EnsembleClient {
 public:
  explicit List(std::vector<double> values) : values_(std::move(values)) {}
  std::optional<int> next(double* state, double* p) override {
    if (next_ == static_cast<int>(values_.size())) return {};
    state[0] = 1, state[1] = 0, p[0] = values_[next_];
    return next_++;
  }
  void point(int set, std::optional<int> place, double t, const double* state, const double*,
             const double* p) override {
    CHECK(p[0] == values_[set]);
    auto& numbers = of(set).numbers;
    numbers.resize(18);  // five times and the end
    double* to = numbers.data() + 3 * place.value_or(5);
    to[0] = t, to[1] = state[0], to[2] = state[1];
  }
  void finished(int set, const Stats& stats) override {
    CHECK(!of(set).finished);
    of(set).finished = true, of(set).stats = stats;
  }
  void abandoned(int set) override { of(set).abandoned = true; }
  std::map<double, Result> results;

 private:
  Result& of(int set) { return results[values_[set]]; }
  std::vector<double> values_;
  int next_ = 0;
};

std::map<double, Result> run(const std::vector<double>& values, int lanes) {
  const ProblemPtr p = std::make_shared<Problem>(swing(), Vec::Ones(1));
  const TableauPtr rk = pair32();
  EnsemblePlan plan;
  plan.to = 5, plan.dt_max = std::numeric_limits<double>::infinity(), plan.most_steps = 1e5;
  plan.times = {0, 0.25, 1, 1.5, 5};
  plan.rtol = Vec::Constant(2, 1e-6), plan.atol = Vec::Constant(2, 1e-8);
  List list(values);
  Ensemble(CompiledLaneStep::make(*p, *rk, true, lanes), plan).run(list);
  return list.results;
}

std::vector<double> spread(int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(-1 + 37.0 * i / count);
  return values;
}

}  // namespace

TEST_CASE("ensemble: lanes give what the ordinary stepper gives, whatever the number of sets") {
  for (int lanes : {4, 8}) {
    if (!codegen::Machine::available(lanes)) continue;
    for (int count : {1, 3, 7, 8, 9, 40}) {
      CAPTURE(lanes);
      CAPTURE(count);
      const auto results = run(spread(count), lanes);
      REQUIRE(results.size() == static_cast<std::size_t>(count));
      for (const auto& [given, result] : results) {
        const double value = given;
        CAPTURE(value);
        REQUIRE(result.finished);
        REQUIRE(result.numbers.size() == 18);
        const ProblemPtr p = std::make_shared<Problem>(swing(), Vec::Constant(1, value));
        Method method;
        method = method_of(pair32());
        Plan plan;
        plan.to = 5, plan.tolerances = {Vec::Constant(2, 1e-6), Vec::Constant(2, 1e-8)};
        const auto alone = integrate_adaptive(p, method, start(vector({1, 0})), plan);
        REQUIRE(alone->finished());
        CHECK(std::labs(alone->stats().steps - result.stats.steps) <= 1);
        for (std::size_t i = 0; i < 6; ++i) {
          const Point there = alone->at(result.numbers[3 * i]);
          // Steps differ by the rounding of the error estimate, results by a fraction of the tolerance.
          CHECK(std::fabs(there.x[0] - result.numbers[3 * i + 1]) < 1e-7 * (1 + std::fabs(there.x[0])));
          CHECK(std::fabs(there.x[1] - result.numbers[3 * i + 2]) < 1e-7 * (1 + std::fabs(there.x[1])));
        }
      }
    }
  }
}

TEST_CASE("ensemble: neighbours, order and number of lanes change no bit") {
  REQUIRE_CODE(4);
  const auto values = spread(21);
  const auto reference = run(values, 4);
  std::vector<double> other(values.rbegin(), values.rend());
  other.insert(other.begin() + 5, {NAN, 1e300, 3e7});  // not a number, not finite on the way, stiff or fast
  for (int lanes : {4, 8}) {
    if (!codegen::Machine::available(lanes)) continue;
    const auto results = run(other, lanes);
    for (double value : values) {
      CAPTURE(lanes);
      CAPTURE(value);
      const Result &a = reference.at(value), &b = results.at(value);
      REQUIRE(b.finished);
      CHECK(a.stats.steps == b.stats.steps);
      CHECK(a.numbers == b.numbers);
    }
    CHECK(results.at(1e300).abandoned);
  }
}

TEST_CASE("ensemble: too many steps, a stiff set and one that is not defined are left to another road") {
  REQUIRE_CODE(4);
  dae::FirstOrder form = ode({x()}, {-k() * (x() - cos(time_symbol())) + Expr(1e-9) * sqrt(k() - 1)});
  form.p = {k()};
  const ProblemPtr p = std::make_shared<Problem>(form, Vec::Constant(1, 2.0));
  EnsemblePlan plan;
  plan.to = 10, plan.dt_max = std::numeric_limits<double>::infinity(), plan.most_steps = 2000;
  plan.rtol = Vec::Constant(1, 1e-6), plan.atol = Vec::Constant(1, 1e-8);
  class One : public EnsembleClient {
   public:
    std::optional<int> next(double* s, double* parameters) override {
      const double values[] = {2, 0.5, 1e4, 3};
      if (next_ == 4) return {};
      s[0] = 1, parameters[0] = values[next_];
      return next_++;
    }
    void point(int, std::optional<int>, double, const double*, const double*, const double*) override {}
    void finished(int set, const Stats&) override { text += "finished " + std::to_string(set) + ", "; }
    void abandoned(int set) override { text += "abandoned " + std::to_string(set) + ", "; }
    std::string text;

   private:
    int next_ = 0;
  } client;
  Ensemble(CompiledLaneStep::make(*p, *pair32(), true, 4), plan).run(client);
  CHECK(client.text.find("abandoned 1, ") == 0);  // √(1/2 - 1) at the start
  CHECK(client.text.find("abandoned 2, ") != std::string::npos);
  CHECK(client.text.find("finished 0, ") != std::string::npos);
  CHECK(client.text.find("finished 3, ") != std::string::npos);
}

TEST_CASE("ensemble: Ctrl-C stops it between two steps") {
  REQUIRE_CODE(4);
  class Pressed : public List {
   public:
    Pressed() : List(spread(100)) {}
    void finished(int set, const Stats& stats) override {
      List::finished(set, stats);
      interrupt_requested = true;
    }
  } client;
  const ProblemPtr p = std::make_shared<Problem>(swing(), Vec::Ones(1));
  EnsemblePlan plan;
  plan.to = 5, plan.dt_max = std::numeric_limits<double>::infinity(), plan.most_steps = 1e5;
  plan.rtol = Vec::Constant(2, 1e-6), plan.atol = Vec::Constant(2, 1e-8);
  CHECK_THROWS_AS(Ensemble(CompiledLaneStep::make(*p, *pair32(), true, 4), plan).run(client), Interrupted);
  interrupt_requested = false;
  CHECK(client.results.size() < 20);
}

}  // namespace pendula::ensemble_test
