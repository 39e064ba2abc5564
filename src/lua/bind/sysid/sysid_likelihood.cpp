// Noise densities, and parameter sets for uniform noise. Reads arguments, calls src/sysid.
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/random/random.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::Density;
using sysid::ParameterSet;

namespace {

/// The density given by a Lua function of e.
Density density_of(lua_State* L, int function) {
  Density f;
  f.kind = Density::Kind::user;
  f.error = symbol(Kind::slot, "e");
  lua_pushvalue(L, function);
  push_expr(L, f.error);
  protected_call(L, 1, 1);
  f.pdf = to_expr(L, lua_gettop(L), "the density");
  lua_pop(L, 1);
  for (const Expr leaf : leaves({&f.pdf, 1}))
    if (leaf != f.error && symbol_of(leaf).kind != Kind::constant)
      throw Error(text("the density may depend on e only, but it contains ", symbol_of(leaf).name));
  if (!depends_on(f.pdf, f.error))
    throw Error("the density does not depend on e; write density(function(e) return exp(-abs(e)) end)");
  return f;
}

/// A distribution as noise density; only a uniform one is possible.
std::shared_ptr<const Density> density_of(const random::Distribution& d) {
  if (d.kind() != random::Distribution::Kind::uniform)
    throw Error(
        text("noise cannot be ", d.code(),
             "; it must be a density such as gaussian(0.1), uniform(-1, 1), laplace() or exponential()"));
  Density f;
  f.kind = Density::Kind::uniform;
  f.low = d.parameters()[0];
  f.high = d.parameters()[1];
  return std::make_shared<const Density>(std::move(f));
}

}  // namespace

std::shared_ptr<const Density> read_noise(Call& call, const Options& o) {
  if (!o.has("noise")) return nullptr;
  const int at = o.push("noise");
  if (lua_isfunction(call.L, at)) {
    const auto made = std::make_shared<const Density>(density_of(call.L, at));
    lua_settop(call.L, call.count());
    return made;
  }
  if (const auto* drawn = object_at(call.L, at, TypeName<random::Distribution>::value)) {
    const auto density = density_of(static_cast<const random::Distribution&>(
        *std::static_pointer_cast<const random::Distribution>(*drawn)));
    lua_settop(call.L, call.count());
    return density;
  }
  const auto* held = object_at(call.L, at, TypeName<Density>::value);
  if (!held)
    throw Error(text(
        "noise must be a density such as gaussian(0.1), uniform(-1, 1), laplace() or exponential(), got ",
        describe(call.L, -1)));
  const auto density = std::static_pointer_cast<const Density>(*held);
  lua_settop(call.L, call.count());
  return density;
}

int push_parameter_set(Call& call, sysid::Regression r, const Density& uniform) {
  return call.push(
      std::make_shared<const ParameterSet>(sysid::parameter_set(std::move(r), uniform.low, uniform.high)));
}

namespace {

int push(Call& call, Density f) { return call.push(std::make_shared<const Density>(std::move(f))); }

double positive(Call& call, int i, const char* name) {
  const double v = call.number(i, name);
  if (!(v > 0) || !std::isfinite(v)) throw Error(text(name, " must be positive, got ", shortest(v)));
  return v;
}

int gaussian(Call& call) {
  Density f;
  if (call.has(1)) f.scale = positive(call, 1, "sigma");
  return push(call, f);
}

int laplace(Call& call) {
  Density f;
  f.kind = Density::Kind::laplace;
  if (object_type(call.L, 1) == "expr" && !constant_at(call.L, 1))
    throw Error("is a density of noise; the transform of an expression is laplace_transform(e, t, s)");
  if (call.has(1)) f.scale = positive(call, 1, "b");
  return push(call, f);
}

int exponential(Call& call) {
  Density f;
  f.kind = Density::Kind::exponential;
  if (call.has(1)) f.scale = 1 / positive(call, 1, "rate");
  return push(call, f);
}

int density(Call& call) {
  call.function(1, "f");
  return push(call, density_of(call.L, 1));
}

/// The distribution of a density, for sampling by sweep.
int distribution(Call& call) {
  const Density& f = call.object<Density>(1, "density");
  if (!f.scale) throw Error("a density without scale cannot be drawn from; write gaussian(0.1)");
  if (f.kind == Density::Kind::gaussian) return call.push(random::normal(0, *f.scale));
  if (f.kind == Density::Kind::exponential) return call.push(random::exponential(1 / *f.scale));
  throw Error(
      text(sysid::describe(f), " cannot be drawn from; normal, uniform, exponential(rate) and others can"));
}

int density_text(Call& call) { return call.push(sysid::describe(call.object<Density>(1, "density"))); }

// ── parameter sets ──

const ParameterSet& set_of(Call& call) { return call.object<ParameterSet>(1, "parameter_set"); }

const ParameterSet& bounded(Call& call, const char* what) {
  const ParameterSet& s = set_of(call);
  if (!s.feasible)
    throw Error(text("the set is empty: there is no ", what, "; see set.smallest_bound and set.deciding"));
  if (!s.bounded)
    throw Error(text("the set is unbounded: there is no ", what, "; see set.unidentifiable and set.box"));
  return s;
}

Expr exact(const ParameterSet& s, Index vertex, Index i) { return Expr(s.polytope.exact[vertex][i]); }

int feasible(Call& call) { return call.push(set_of(call).feasible); }
int is_bounded(Call& call) { return call.push(set_of(call).bounded); }
int is_exact(Call& call) { return call.push(!set_of(call).polytope.exact.empty()); }

int vertices(Call& call) {
  const ParameterSet& s = set_of(call);
  if (s.feasible) bounded(call, "vertex list");
  const Mat& v = s.polytope.vertices;
  if (s.polytope.exact.empty()) return push_matrix(call.L, v);
  MatX m(v.rows(), v.cols());
  for (Index k = 0; k < v.rows(); ++k)
    for (Index i = 0; i < v.cols(); ++i) m(k, i) = exact(s, k, i);
  return push_matrix(call.L, m);
}

/// A list of { low, high, low =, high = }, exact if the vertices are.
int box(Call& call) {
  const ParameterSet& s = set_of(call);
  if (!s.feasible) bounded(call, "box");
  lua_createtable(call.L, static_cast<int>(s.box.rows()), 0);
  for (Index i = 0; i < s.box.rows(); ++i) {
    lua_createtable(call.L, 2, 2);
    for (const Index side : {0, 1}) {
      bool pushed = false;
      for (Index k = 0; !pushed && k < static_cast<Index>(s.polytope.exact.size()); ++k)
        if (s.polytope.vertices(k, i) == s.box(i, side)) pushed = push_expr(call.L, exact(s, k, i)) == 1;
      if (!pushed) lua_pushnumber(call.L, s.box(i, side));
      lua_pushvalue(call.L, -1);
      lua_setfield(call.L, -3, side == 0 ? "low" : "high");
      lua_rawseti(call.L, -2, side + 1);
    }
    lua_rawseti(call.L, -2, i + 1);
  }
  return 1;
}

int center(Call& call) { return push_matrix(call.L, Mat(bounded(call, "centre").center)); }
int radius(Call& call) { return call.push(bounded(call, "radius").radius); }
int likelihood_theta(Call& call) { return push_matrix(call.L, Mat(set_of(call).center)); }

int volume(Call& call) {
  const ParameterSet& s = set_of(call);
  if (!s.feasible) return call.push(0);
  if (!s.bounded) return call.push(HUGE_VAL);
  if (s.polytope.exact.empty()) return call.push(sysid::volume(s.strips, s.polytope));
  return push_expr(call.L, Expr(sysid::exact_volume(s.polytope)));
}

int likelihood_names(Call& call) { return push_words(call.L, set_of(call).regression.names); }
int likelihood_unidentifiable(Call& call) { return push_words(call.L, set_of(call).free); }
int likelihood_rows(Call& call) { return call.push(static_cast<long>(set_of(call).regression.y.size())); }

sysid::SmallestBound smallest(const ParameterSet& s) {
  if (s.smallest.theta.size() > 0) return s.smallest;
  return sysid::smallest_bound(s.regression.Phi, s.regression.y.array() - (s.low + s.high) / 2);
}

int smallest_bound(Call& call) { return call.push(smallest(set_of(call)).bound); }

int deciding(Call& call) {
  const ParameterSet& s = set_of(call);
  Vec samples(0);
  for (const Index row : smallest(s).rows) {
    samples.conservativeResize(samples.size() + 1);
    samples[samples.size() - 1] = static_cast<double>(s.regression.sample[row]);
  }
  lua_createtable(call.L, static_cast<int>(samples.size()), 0);
  for (Index i = 0; i < samples.size(); ++i) {
    lua_pushinteger(call.L, static_cast<lua_Integer>(samples[i]));
    lua_rawseti(call.L, -2, i + 1);
  }
  return 1;
}

int contains(Call& call) {
  const ParameterSet& s = set_of(call);
  const Vec point = to_data(call.L, 2, "theta").reshaped();
  if (point.size() != s.strips.Phi.cols())
    throw Error(text("theta: expected ", s.strips.Phi.cols(), " numbers (", join(s.regression.names, ", "),
                     "), got ", point.size()));
  const auto row = sysid::violated(s, point);
  call.push(!row);
  if (!row) return 1;
  call.push(static_cast<long>(s.regression.sample[*row]));
  return 2;
}

int likelihood_text(Call& call) { return call.push(sysid::describe(set_of(call))); }

}  // namespace

extern const Module likelihood_module = {
    "identification",
    "",
    {
        {"gaussian", gaussian, "gaussian([sigma]) -> density",
         R"(Normal noise: maximum likelihood is least squares with covariance σ²(ΦᵀΦ)⁻¹; σ is estimated if
            it is not given.)",
         "print(gaussian(0.1))", "Gaussian noise, σ = 0.1"},
        {"laplace", laplace, "laplace([b]) -> density",
         R"(Density exp(-|e|/b)/(2b): maximum likelihood is least absolute deviations, robust against
            outliers.)",
         R"(
            d = iddata{ y = {1, 2, 3, 40}, u = {1, 2, 3, 4} }
            fir(d, { nb = 1, nk = 0, noise = laplace() }).theta[1])",
         "1.0"},
        {"exponential", exponential, "exponential([rate]) -> density",
         R"(Density λ exp(-λ e) for e ≥ 0: maximum likelihood is a linear program, all errors positive with
            the least sum.)",
         R"(
            d = iddata{ y = {1, 2.5, 3, 4}, u = {1, 2, 3, 4} }
            fir(d, { nb = 1, nk = 0, noise = exponential() }).theta[1])",
         "1.0"},
        {"density", density, "density(f) -> density",
         R"(Noise with any positive density f(e), a function that returns an expression. A factor that does
            not depend on e may be left out.)",
         R"(
            d = iddata{ y = {1, 2, 3, 40}, u = {1, 2, 3, 4} }
            m = fir(d, { nb = 1, nk = 0, noise = density(function(e) return 1/(1 + e^2)^2 end) })
            print(("%.3f"):format(m.theta[1])))",
         "1.008"},
        {"density#distribution", distribution, "f.distribution -> distribution",
         "The same as a distribution to draw from, in sweep and ks_test.", "print(gaussian(2).distribution)",
         "normal(0, 2)"},
        {"density:__tostring", density_text, "print(density)", "The density in words.", "", ""},
        {"parameter_set#feasible", feasible, "set.feasible -> boolean",
         "There are parameters that explain all rows.", "", ""},
        {"parameter_set#bounded", is_bounded, "set.bounded -> boolean", "The regressor has full rank.", "",
         ""},
        {"parameter_set#exact", is_exact, "set.exact -> boolean",
         "Vertices, box and volume are rational numbers.", "", ""},
        {"parameter_set#vertices", vertices, "set.vertices -> matrix",
         "One vertex per row; counter-clockwise for two parameters. Without rows if the set is empty.", "",
         ""},
        {"parameter_set#box", box, "set.box -> list of { low, high }",
         "The interval of every parameter, also as .low and .high.", "", ""},
        {"parameter_set#center", center, "set.center -> column",
         "The centre of the largest ball inside (Chebyshev centre, the minimax estimate).", "", ""},
        {"parameter_set#centre", center, "set.centre -> column", "The same as set.center.", "", ""},
        {"parameter_set#radius", radius, "set.radius -> number", "The radius of that ball.", "", ""},
        {"parameter_set#theta", likelihood_theta, "set.theta -> column",
         R"(One point of the set: the Chebyshev centre; of an empty set, the point of the smallest feasible
            bound.)",
         "", ""},
        {"parameter_set#volume", volume, "set.volume -> number",
         "Volume (area for two parameters); 0 if empty, inf if unbounded.", "", ""},
        {"parameter_set#area", volume, "set.area -> number", "The same as set.volume.", "", ""},
        {"parameter_set#names", likelihood_names, "set.names -> list", "The names of the parameters.", "",
         ""},
        {"parameter_set#unidentifiable", likelihood_unidentifiable, "set.unidentifiable -> list",
         "The unbounded directions in words.", "", ""},
        {"parameter_set#rows", likelihood_rows, "set.rows -> integer", "The number of rows.", "", ""},
        {"parameter_set#smallest_bound", smallest_bound, "set.smallest_bound -> number",
         "The smallest γ for which |e - (low + high)/2| ≤ γ leaves a point.", "", ""},
        {"parameter_set#deciding", deciding, "set.deciding -> list",
         "The samples whose rows decide the smallest bound.", "", ""},
        {"parameter_set:contains", contains, "set:contains(theta) -> boolean [, sample]",
         "Whether θ explains all rows; if not, the first sample that it does not explain.",
         R"(
            s = lsq({1, 1}, {0.5, 1.25}, { noise = uniform(-1, 1) })
            s:contains {1}, s:contains {0})",
         "true false 2"},
        {"parameter_set:__tostring", likelihood_text, "print(set)",
         "Vertices, intervals, centre, volume; or why it is empty.", "", ""},
    }};

}  // namespace pendula::lua
