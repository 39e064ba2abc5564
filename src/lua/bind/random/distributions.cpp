// Distributions as values: normal(1, 0.1), …
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/random/random.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

random::DistributionPtr distribution_at(lua_State* L, int index) {
  if (const auto* held = object_at(L, index, TypeName<random::Distribution>::value))
    return std::static_pointer_cast<const random::Distribution>(*held);
  const std::string type = object_type(L, index);
  if (type.empty() || !push_member(L, type.c_str(), "distribution")) {
    if (!type.empty()) lua_pop(L, 1);
    return nullptr;
  }
  lua_pushvalue(L, index < 0 ? index - 1 : index);
  protected_call(L, 1, 1);
  const auto* held = object_at(L, -1, TypeName<random::Distribution>::value);
  const auto found = held ? std::static_pointer_cast<const random::Distribution>(*held) : nullptr;
  lua_pop(L, 1);
  return found;
}

namespace {

int push(Call& call, random::DistributionPtr d) { return call.push(std::move(d)); }

int normal(Call& call) {
  if (lua_type(call.L, 1) == LUA_TTABLE || call.is<Matrix>(1))
    return call.push(std::make_shared<const random::JointNormal>(to_numbers(call.L, 1, "mean"),
                                                                 to_numeric_matrix(call.L, 2, "covariance")));
  return push(call, random::normal(call.number(1, "mean", 0), call.number(2, "sigma", 1)));
}

int lognormal(Call& call) {
  return push(call, random::lognormal(call.number(1, "mu"), call.number(2, "sigma")));
}

int uniform(Call& call) { return push(call, random::uniform(call.number(1, "low"), call.number(2, "high"))); }

int triangular(Call& call) {
  return push(call,
              random::triangular(call.number(1, "low"), call.number(2, "mode"), call.number(3, "high")));
}

int beta(Call& call) {
  return push(call, random::beta(call.number(1, "a"), call.number(2, "b"), call.number(3, "low", 0),
                                 call.number(4, "high", 1)));
}

std::vector<double> numbers(Call& call, int i, const char* name) {
  const Vec v = to_numbers(call.L, i, name);
  return {v.begin(), v.end()};
}

int discrete(Call& call) {
  return push(call, random::discrete(numbers(call, 1, "values"),
                                     call.has(2) ? numbers(call, 2, "weights") : std::vector<double>()));
}

int empirical(Call& call) { return push(call, random::empirical(numbers(call, 1, "data"))); }

// ── methods ──

const random::Distribution& self(Call& call) { return call.object<random::Distribution>(1, "distribution"); }

/// f of a number, or of every entry of a list or matrix.
int push_each(Call& call, const char* name, const std::function<double(double)>& f) {
  if (lua_type(call.L, 2) == LUA_TNUMBER || is_expression(call.L, 2))
    return call.push(f(call.number(2, name)));
  Mat m = to_numeric_matrix(call.L, 2, name);
  for (double& x : m.reshaped()) x = f(x);
  return push_matrix(call.L, m);
}

int quantile(Call& call) {
  const random::Distribution& d = self(call);
  return push_each(call, "p", [&](double p) {
    if (!(p >= 0 && p <= 1)) throw Error(text("p = ", shortest(p), "; a probability lies between 0 and 1"));
    return d.quantile(p);
  });
}

int cdf(Call& call) {
  return push_each(call, "x", [&d = self(call)](double x) { return d.cdf(x); });
}

int mean(Call& call) { return call.push(self(call).mean()); }
int deviation(Call& call) { return call.push(self(call).deviation()); }

int sample(Call& call) {
  const random::Distribution& d = self(call);
  ScriptNumbers& series = script_numbers(call.L);
  if (!call.has(2)) return call.push(d.quantile(next_uniform(series)));
  const long n = call.integer(2, "n");
  if (n < 0 || n > 100'000'000)
    throw Error(text("n = ", n, "; at most 100 000 000 numbers are made at a time"));
  Vec v(n);
  for (double& x : v) x = d.quantile(next_uniform(series));
  return push_matrix(call.L, Mat(v));
}

int distribution_text(Call& call) { return call.push(self(call).code()); }

// ── joint distributions ──

const random::JointNormal& joint(Call& call) { return call.object<random::JointNormal>(1, "distribution"); }

int component(Call& call) {
  const long i = call.integer(2, "i");
  const int n = joint(call).size();
  if (i < 1 || i > n) throw Error(text("there are ", n, " components; number ", i, " does not exist"));
  return call.push(std::make_shared<const JointComponent>(
      JointComponent{call.shared<random::JointNormal>(1, "distribution"), static_cast<int>(i - 1)}));
}
int same_joint(Call& call) {
  const auto* other = object_at(call.L, 2, TypeName<random::JointNormal>::value);
  return call.push(other && other->get() == &joint(call));
}
int joint_length(Call& call) { return call.push(joint(call).size()); }
int joint_mean(Call& call) { return push_matrix(call.L, Mat(joint(call).mean())); }
int joint_covariance(Call& call) { return push_matrix(call.L, joint(call).covariance()); }
int joint_text(Call& call) {
  return call.push(text("normal distribution of ", joint(call).size(), " numbers with a covariance"));
}
int component_text(Call& call) {
  const JointComponent& c = call.object<JointComponent>(1, "component");
  return call.push(
      text("component ", c.number + 1, " of a normal distribution of ", c.joint->size(), " numbers"));
}
const JointComponent& member(Call& call) { return call.object<JointComponent>(1, "component"); }
int component_joint(Call& call) { return call.push(member(call).joint); }
int component_number(Call& call) { return call.push(member(call).number + 1); }

}  // namespace

extern const Module distributions_module = {
    "random",
    "",
    {
        {"normal", normal, "normal([mean [, sigma]]) -> distribution; normal(means, covariance)",
         R"(A normal distribution by mean (0) and standard deviation (1), for sweep. Of a list of means and a
            covariance matrix: several numbers that vary together; d[1], d[2], … are given to the parameters.)",
         "print(normal(1, 0.1):quantile(0.975))", "1.195996398454"},
        {"lognormal", lognormal, "lognormal(mu, sigma) -> distribution",
         "exp(x) of a normal x with mean mu and standard deviation sigma.",
         "print(lognormal(0, 1):quantile(0.5))", "1.0"},
        {"uniform", uniform, "uniform(low, high) -> distribution",
         R"(All numbers of [low, high] are equally likely. As noise = uniform(-1, 1) of arx and lsq: the
            likelihood is then constant on a polytope of parameters and zero outside; they return that set.)",
         R"(
            print(uniform(2, 4):quantile(0.25))
            set = lsq({1, 1}, {0.5, 1.25}, { noise = uniform(-1, 1), names = "a" })
            print(set.center.T))",
         "2.5\n0.875"},
        {"triangular", triangular, "triangular(low, mode, high) -> distribution",
         "A density that rises linearly from low to mode and falls linearly to high.",
         "print(triangular(0, 1, 4).mean)", "1.6666666666667"},
        {"beta", beta, "beta(a, b [, low, high]) -> distribution",
         "The beta distribution: density proportional to x^(a-1) (1-x)^(b-1), on [0, 1] or [low, high].",
         "print(beta(2, 2):cdf(0.5))", "0.5"},
        {"discrete", discrete, "discrete(values [, weights]) -> distribution",
         "One of the values, all equally likely, or in proportion to the weights.",
         "print(discrete({10, 20}, {1, 3}).mean)", "17.5"},
        {"empirical", empirical, "empirical(data) -> distribution",
         "One of the data, all equally likely: drawing from it is resampling.",
         "print(empirical{3, 1, 2}:quantile(0.5))", "2.0"},
        {"distribution:quantile", quantile, "d:quantile(p) -> number or matrix",
         "The value that is not exceeded with probability p (of every entry of a list).",
         "return normal(0, 1):quantile(0.5)", "0.0"},
        {"distribution:cdf", cdf, "d:cdf(x) -> number or matrix",
         "The probability of a number up to x (of every entry of a list).", "return normal(0, 1):cdf(0)",
         "0.5"},
        {"distribution#mean", mean, "d.mean -> number", "The expected value.", "", ""},
        {"distribution#std", deviation, "d.std -> number", "The standard deviation.", "", ""},
        {"distribution:sample", sample, "d:sample([n]) -> number or column",
         "Random numbers from the distribution, from the sequence of rand.",
         "return #normal(0, 1):sample(10)", "10"},
        {"distribution:__tostring", distribution_text, "print(d)", "The call that makes it.", "", ""},
        {"joint_distribution:__index", component, "d[i] -> component",
         "Entry i of a vector whose entries vary together: params = { m = d[1], L = d[2] }.",
         "d = normal({1, 2}, {{0.04, 0.01}, {0.01, 0.09}})\nprint(d[2])",
         "component 2 of a normal distribution of 2 numbers"},
        {"joint_distribution:__len", joint_length, "#d", "How many numbers.", "", ""},
        {"joint_distribution:__eq", same_joint, "d == e -> boolean",
         "The same numbers, not only numbers of the same distribution.", R"(
             n = normal({ 1, 2 }, {{0.04, 0.01}, {0.01, 0.09}})
             n == n, n == normal({ 1, 2 }, {{0.04, 0.01}, {0.01, 0.09}}))",
         "true false"},
        {"joint_distribution#mean", joint_mean, "d.mean -> column", "The means.", "", ""},
        {"joint_distribution#cov", joint_covariance, "d.cov -> matrix", "The covariance.", "", ""},
        {"joint_distribution:__tostring", joint_text, "print(d)", "The distribution in words.", "", ""},
        {"joint_component#joint", component_joint, "c.joint -> joint_distribution",
         "The joint distribution of the component.", "", ""},
        {"joint_component#number", component_number, "c.number -> integer", "Which component.", "", ""},
        {"joint_component:__tostring", component_text, "print(c)", "The component in words.", "", ""},
    }};

}  // namespace pendula::lua
