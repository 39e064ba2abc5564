// Responses in time and frequency. Reads arguments, calls src/lti; the figures are made in stdlib/lti.lua.
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lti/frequency.hpp"
#include "lti/response.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

namespace {

using lti::System;

int response_push_response(Call& call, lti::Response r) {
  return call.push(std::make_shared<const lti::Response>(std::move(r)));
}

const OptionTable time_options = {
    {"to", "number", "", "the end, in s; else until the response has settled"},
    {"times", "list of numbers", "", "the times, in s"},
};

const OptionTable lsim_options = {
    {"between", "string", "\"linear\"", "how the data continue between the times", "linear|hold"},
};

}  // namespace

Vec read_times(Call& call, int i, const std::function<Vec(std::optional<double>)>& until) {
  if (!call.has(i)) return until({});
  if (lua_istable(call.L, i) && lua_rawlen(call.L, i) == 0) {
    const Options o = call.options(i, time_options);
    if (o.has("times")) {
      const Vec t = to_numbers(call.L, o.push("times"), "times");
      lua_settop(call.L, call.count());
      return t;
    }
    return until(o.has("to") ? std::optional(o.number("to")) : std::nullopt);
  }
  if (is_expression(call.L, i)) return until(to_number(call.L, i, "to"));
  Mat m = to_numeric_matrix(call.L, i, "t");
  if (m.cols() != 1) m.transposeInPlace();
  if (m.cols() != 1)
    throw Error(text("t must be a list of times, not a ", m.cols(), "×", m.rows(), " matrix"));
  return m.col(0);
}

namespace {

Vec times_of(Call& call, int i, const System& g) {
  return read_times(call, i, [&](std::optional<double> to) {
    return to ? lti::response_times(g, *to) : lti::response_times(g);
  });
}

int response_step(Call& call) {
  const System g = read_system(call, 1, "G");
  return response_push_response(call, lti::step(g, times_of(call, 2, g)));
}
int impulse(Call& call) {
  const System g = read_system(call, 1, "G");
  return response_push_response(call, lti::impulse(g, times_of(call, 2, g)));
}
Vec read_x0(Call& call, int i, const System& g) {
  if (!call.has(i)) return Vec::Zero(g.ss.order());
  const VecX x = read_state(call.L, i, "x0", g);
  return lti::numbers(MatX(x)).col(0);
}
int initial(Call& call) {
  const System g = lti::to_ss(read_system(call, 1, "G"));
  if (!call.has(2)) call.wrong(2, "x0", "a column of initial states, or a table by their names");
  return response_push_response(call, lti::initial(g, read_x0(call, 2, g), times_of(call, 3, g)));
}

/// The values of the inputs from the value on top of the stack, which is popped.
Vec popped_inputs(lua_State* L, int inputs, double t) {
  const Vec u = is_expression(L, -1) ? Vec(Vec::Constant(1, to_number(L, lua_gettop(L), "u(t)")))
                                     : to_numbers(L, lua_gettop(L), "u(t)");
  lua_pop(L, 1);
  if (u.size() != inputs)
    throw Error(text("u(t) has ", u.size(), " values for ", inputs, inputs == 1 ? " input" : " inputs"));
  if (!u.allFinite()) throw Error(text("u(", rounded(t), ") is not a finite number"));
  return u;
}

std::function<Vec(double)> read_function(Call& call, int i, int inputs) {
  lua_State* L = call.L;
  if (lua_isfunction(L, i))
    return [L, i, inputs](double t) {
      lua_pushvalue(L, i);
      lua_pushnumber(L, t);
      protected_call(L, 1, 1);
      return popped_inputs(L, inputs, t);
    };
  const VecX u = to_column(L, i, "u");
  if (u.size() != inputs)
    throw Error(text("u has ", u.size(), u.size() == 1 ? " entry" : " entries", " for ", inputs,
                     inputs == 1 ? " input" : " inputs"));
  for (Expr leaf : leaves(entries(u)))
    if (leaf != time_symbol() && symbol_of(leaf).kind != Kind::constant &&
        !(symbol_of(leaf).kind == Kind::parameter && symbol_of(leaf).value))
      throw Error(text("u must be an expression in t with numbers, but it contains '", to_text(leaf), "'"));
  return [u](double t) {
    std::unordered_map<Expr, double> values{{time_symbol(), t}};
    for (Expr leaf : leaves(entries(u)))
      if (symbol_of(leaf).kind == Kind::parameter) values[leaf] = lti::number(*symbol_of(leaf).value);
    const auto v = evaluate(entries(u), values);
    const Vec result = Eigen::Map<const Vec>(v.data(), static_cast<Eigen::Index>(v.size()));
    if (!result.allFinite()) throw Error(text("u is not a finite number at t = ", rounded(t)));
    return result;
  };
}

/// Is argument i an expression in t, or a list of such?
bool is_formula(Call& call, int i, int inputs) {
  if (lua_isfunction(call.L, i)) return true;
  if (is_expression(call.L, i)) return true;
  if (call.is<Matrix>(i) && call.object<Matrix>(i, "u").numeric()) return false;
  const MatX u = to_matrix(call.L, i, "u");
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (!u.data()[k].is_constant()) return u.size() == inputs;
  return false;
}

int response_lsim(Call& call) {
  const System given = read_system(call, 1, "G"), g = lti::to_ss(given);
  if (!call.has(2)) call.wrong(2, "u", "an expression in t, a function, or data with one row per time");
  if (!call.has(3) && !lua_isfunction(call.L, 2) && g.continuous())
    call.wrong(3, "t", "a list of times such as linspace(0, 10, 101)");
  std::string between = "linear";
  if (call.has(5)) between = call.options(5).string("between", "linear");
  if (between != "linear" && between != "hold")
    throw Error(text("option 'between' must be \"linear\" or \"hold\", got '", between, "'"));
  if (is_formula(call, 2, g.inputs)) {
    const Vec t = times_of(call, 3, g);
    return response_push_response(call,
                                  lti::simulate(g, read_function(call, 2, g.inputs), t, read_x0(call, 4, g)));
  }
  Mat u = to_numeric_matrix(call.L, 2, "u");
  if (g.inputs == 1 && u.cols() != 1 && u.rows() == 1) u.transposeInPlace();
  Vec t;
  if (call.has(3))
    t = times_of(call, 3, g);
  else
    t = Vec::LinSpaced(u.rows(), 0, static_cast<double>(u.rows() - 1) * lti::number(g.Ts));
  return response_push_response(call, lti::simulate(g, u, t, read_x0(call, 4, g), between == "hold"));
}

// ── fields of a response ──

const lti::Response& response(Call& call) { return call.object<lti::Response>(1, "response"); }

/// One matrix, rows by time; the columns for the first input come first.
Mat side_by_side(const std::vector<Mat>& parts) {
  Mat all(parts[0].rows(), parts[0].cols() * static_cast<Eigen::Index>(parts.size()));
  for (std::size_t j = 0; j < parts.size(); ++j)
    all.middleCols(static_cast<Eigen::Index>(j) * parts[0].cols(), parts[0].cols()) = parts[j];
  return all;
}
int times(Call& call) { return push_matrix(call.L, Mat(response(call).t)); }
int y(Call& call) { return push_matrix(call.L, side_by_side(response(call).y)); }
int x(Call& call) { return push_matrix(call.L, side_by_side(response(call).x)); }
int kind(Call& call) { return call.push(response(call).kind); }
int labels(Call& call) {
  const auto& r = response(call);
  std::vector<std::string> list;
  for (std::size_t j = 0; j < r.y.size(); ++j)
    for (int i = 0; i < r.system->outputs; ++i)
      list.push_back(lti::output_name(*r.system, i) +
                     (r.y.size() == 1 ? "" : " from " + lti::input_name(*r.system, static_cast<int>(j))));
  return push_names(call.L, list);
}
int discrete(Call& call) { return call.push(!response(call).system->continuous()); }

const lti::CurveFacts& only_curve(Call& call) {
  const auto& r = response(call);
  if (r.kind != "step")
    throw Error(text("only step responses have this value; this is a response of kind \"", r.kind, "\""));
  if (r.facts.empty() && r.settles)
    throw Error("no characteristic values are computed for a system with delays; see r.y");
  if (r.facts.empty()) throw Error("some poles do not decay: there is no final value");
  if (r.facts.size() != 1 || r.facts[0].size() != 1)
    throw Error("of several channels: choose one with G:channel(i, j):step()");
  return r.facts[0][0];
}
int push_fact(Call& call, const std::optional<double>& v) {
  if (v) return call.push(*v);
  return call.push_nil();
}
int final(Call& call) { return call.push(only_curve(call).final); }
int peak(Call& call) { return call.push(only_curve(call).peak); }
int peak_time(Call& call) { return call.push(only_curve(call).peak_time); }
int rise_time(Call& call) { return push_fact(call, only_curve(call).rise_time); }
int settling_time(Call& call) { return push_fact(call, only_curve(call).settling_time); }
int overshoot(Call& call) { return push_fact(call, only_curve(call).overshoot); }
int response_text(Call& call) { return call.push(lti::describe(response(call))); }

// ── frequency ──

int response_freqresp(Call& call) {
  const System g = read_system(call, 1, "G");
  Vec w = lti::bode_frequencies(g);
  if (call.has(2)) {
    Mat m = to_numeric_matrix(call.L, 2, "w");
    if (m.cols() != 1) m.transposeInPlace();
    if (m.cols() != 1) throw Error("w must be a list of frequencies in rad/s");
    w = m.col(0);
    if (w.size() == 2 && w[0] < w[1] && w[0] > 0 && lua_istable(call.L, 2)) {  // { from, to }
      const double low = std::log10(w[0]), high = std::log10(w[1]);
      w = Vec::LinSpaced(400, low, high).unaryExpr([](double v) { return std::pow(10, v); });
    }
  }
  return call.push(std::make_shared<const lti::FrequencyResponse>(lti::frequency_response(g, w)));
}

const lti::FrequencyResponse& frequency(Call& call) {
  return call.object<lti::FrequencyResponse>(1, "response");
}

template <class Read>
int push_curves(Call& call, const Read& read) {
  const auto& r = frequency(call);
  Mat m(r.w.size(), static_cast<Eigen::Index>(r.G.size()));
  Eigen::Index column = 0;
  for (int j = 0; j < r.system->inputs; ++j)
    for (int i = 0; i < r.system->outputs; ++i) m.col(column++) = read(r.channel(i, j));
  return push_matrix(call.L, m);
}
int w(Call& call) { return push_matrix(call.L, Mat(frequency(call).w)); }
int mag(Call& call) {
  return push_curves(call, [](const lti::ComplexVec& g) { return Vec(g.cwiseAbs()); });
}
int db(Call& call) { return push_curves(call, lti::decibels); }
int phase(Call& call) {
  const auto& r = frequency(call);
  Mat m(r.w.size(), static_cast<Eigen::Index>(r.G.size()));
  Eigen::Index column = 0;
  for (int j = 0; j < r.system->inputs; ++j)
    for (int i = 0; i < r.system->outputs; ++i) m.col(column++) = lti::phase(r, i, j);
  return push_matrix(call.L, m);
}
int response_re(Call& call) {
  return push_curves(call, [](const lti::ComplexVec& g) { return Vec(g.real()); });
}
int response_im(Call& call) {
  return push_curves(call, [](const lti::ComplexVec& g) { return Vec(g.imag()); });
}
int channels(Call& call) {
  const auto& r = frequency(call);
  std::vector<std::string> list;
  for (int j = 0; j < r.system->inputs; ++j)
    for (int i = 0; i < r.system->outputs; ++i)
      list.push_back(
          r.system->siso() ? "G" : lti::output_name(*r.system, i) + " from " + lti::input_name(*r.system, j));
  return push_names(call.L, list);
}
int system_field(Call& call) { return call.push(frequency(call).system); }

int frequency_text(Call& call) {
  const auto& r = frequency(call);
  std::string out = text("frequency response: ", r.w.size(), " frequencies, ", rounded(r.w[0], 6), " ≤ ω ≤ ",
                         rounded(r.w[r.w.size() - 1], 6), " rad/s");
  if (r.system->siso() && !r.delayed) {
    Eigen::Index at = 0;
    r.G[0].cwiseAbs().maxCoeff(&at);
    out += text("\n  largest |G| = ", rounded(std::abs(r.G[0][at]), 4), " at ω = ", rounded(r.w[at], 4));
    std::string margins = "\n" + lti::describe(lti::margins(*r.system));
    for (std::size_t k = 0; (k = margins.find('\n', k)) != std::string::npos; k += 3)
      margins.insert(k + 1, "  ");
    out += margins;
  }
  return call.push(out);
}

}  // namespace

extern const Module lti_response_module = {
    "lti responses",
    "Linear systems: responses in time and frequency",
    {
        {"lti:step", response_step, "G:step([to or times]) -> response",
         R"(The response to a unit step at t = 0, exact at the times. .t .y .x, and .final .rise_time
            .settling_time .overshoot .peak .peak_time; :plot() :show() :save(file).)",
         "r = tf({4}, {1, 2, 4}):step(8)  return #r.t, math.abs(r.overshoot - "
         "100*math.exp(-math.pi/math.sqrt(3))) < 0.01",
         "301 true"},
        {"lti:impulse", impulse, "G:impulse([to or times]) -> response",
         "The response to a unit impulse; in discrete time to the samples 1, 0, 0 and so on.",
         "tf({1}, {1, 1}):impulse({0, 1}).y(2, 1) == math.exp(-1)", "true"},
        {"lti:initial", initial, "G:initial(x0 [, to or times]) -> response",
         "The response to an initial state without inputs.",
         "ss({{-1}}, {1}):initial({2}, {0, 1}).y(2, 1) == 2*math.exp(-1)", "true"},
        {"lsim", response_lsim, R"(lsim(G, u, t [, x0 [, { between = "linear" or "hold" }]]) -> response)",
         R"(The response to any input. u: an expression in t or a function (integrated by Gauss' formula
            between the times), or data with one row per time, joined by straight lines or held.)",
         "r = lsim(tf({1}, {1, 1}), sin(t), linspace(0, 2, 21))  return math.abs(r.y(21, 1) - "
         "(math.exp(-2) + math.sin(2) - math.cos(2))/2) < 1e-12",
         "true", &lsim_options},
        {"lti:lsim", response_lsim, "G:lsim(u, t [, x0 [, options]]) -> response",
         "The same as lsim(G, u, t, x0).",
         "times = linspace(0, 10, 101)  return tf({1}, {1, 1}):lsim(map(times, math.sin), times):plot()", "",
         &lsim_options},
        {"response#t", times, "r.t -> column", "The times."},
        {"response#y", y, "r.y -> matrix",
         "The outputs, one row per time; with several inputs those of the first come first."},
        {"response#x", x, "r.x -> matrix", "The states, one row per time."},
        {"response#kind", kind, "r.kind -> string", R"("step", "impulse", "initial" or "lsim".)"},
        {"response#labels", labels, "r.labels -> list", "The names of the columns of y."},
        {"response#discrete", discrete, "r.discrete -> boolean", "In discrete time."},
        {"response#final", final, "r.final -> number", "The final value of a step response."},
        {"response#peak", peak, "r.peak -> number", "The greatest value."},
        {"response#peak_time", peak_time, "r.peak_time -> number", "When it is reached."},
        {"response#rise_time", rise_time, "r.rise_time -> number", "From 10 % to 90 % of the final value."},
        {"response#settling_time", settling_time, "r.settling_time -> number",
         "Until it stays within 2 % of the final value."},
        {"response#overshoot", overshoot, "r.overshoot -> number", "Overshoot in percent."},
        {"response:__tostring", response_text, "print(r)", "The values read from the curves."},
        {"lti:freqresp", response_freqresp, "G:freqresp([frequencies]) -> frequency response",
         "G(iω), in discrete time G(e^{iωTs}). .w .mag .db .phase .re .im.",
         "r = tf({1}, {1, 1}):freqresp({1})  return math.abs(r.mag(1, 1)^2 - 0.5) < 1e-15, r.phase(1, 1)",
         "true -45.0"},
        {"lti:bode", response_freqresp, "G:bode([frequencies or { from, to }]) -> frequency response",
         R"(Gain and phase over the frequency: .w .mag .db .phase, margins in print; :plot() :show()
            :save(file) draw both.)",
         "G = tf({1}, {1, 1, 1})  return G:bode():plot()", ""},
        {"frequency response#w", w, "r.w -> column", "Frequencies in rad/s."},
        {"frequency response#mag", mag, "r.mag -> matrix", "|G|, one column per channel."},
        {"frequency response#magnitude", mag, "r.magnitude -> matrix", "The same as r.mag."},
        {"frequency response#db", db, "r.db -> matrix", "20 log₁₀|G|."},
        {"frequency response#phase", phase, "r.phase -> matrix", "The phase in degrees, without jumps."},
        {"frequency response#re", response_re, "r.re -> matrix", "Real parts."},
        {"frequency response#im", response_im, "r.im -> matrix", "Imaginary parts."},
        {"frequency response#labels", channels, "r.labels -> list",
         "The channels, in the order of the columns."},
        {"frequency response#system", system_field, "r.system -> G", "The system."},
        {"frequency response:__tostring", frequency_text, "print(G:bode())",
         "The range, the peak and the margins."},
    }};

}  // namespace pendula::lua
