// Input signals and their spectra. Reads arguments, calls src/sysid.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "sysid/data/signals.hpp"

namespace pendula::lua {

template <>
struct TypeName<sysid::Spectrum> {
  static constexpr const char* value = "spectrum";
};

namespace {

int push_signal(Call& call, const Vec& u) { return push_matrix(call.L, Mat(u)); }

int prbs(Call& call) {
  const long n = call.integer(1, "samples");
  const Options o = call.options(2);
  sysid::Prbs p;
  if (o.has("order")) p.order = static_cast<int>(o.integer("order", 0));
  p.hold = static_cast<int>(o.integer("hold", 1));
  p.low = o.number("low", -1);
  p.high = o.number("high", 1);
  p.seed = o.integer("seed", 1);
  return push_signal(call, sysid::prbs(n, p));
}

int multisine(Call& call) {
  const long n = call.integer(1, "samples");
  const Options o = call.options(2);
  sysid::Multisine m;
  if (o.has("lines")) {
    for (int k : to_whole_numbers(call.L, o.push("lines"), "lines")) m.lines.push_back(k);
    lua_pop(call.L, 1);
  }
  if (o.has("amplitudes")) {
    const Vec a = to_numbers(call.L, o.push("amplitudes"), "amplitudes");
    m.amplitudes.assign(a.data(), a.data() + a.size());
    lua_pop(call.L, 1);
  }
  m.phases = o.string("phases", m.phases);
  m.peak = o.number("peak", 1);
  m.seed = o.integer("seed", 1);
  return push_signal(call, sysid::multisine(n, m));
}

int chirp(Call& call) {
  const long n = call.integer(1, "samples");
  call.table(2, "options");
  const Options o = call.options(2);
  sysid::Chirp c;
  c.from = o.number("from");
  c.to = o.number("to");
  c.Ts = o.number("Ts", 1);
  c.amplitude = o.number("amplitude", 1);
  const std::string method = o.string("method", "linear");
  if (method != "linear" && method != "exponential")
    throw Error(text("method must be \"linear\" or \"exponential\", got '", method, "'"));
  c.exponential = method == "exponential";
  return push_signal(call, sysid::chirp(n, c));
}

sysid::Periodic read_periodic(Call& call, double duty) {
  call.table(2, "options");
  const Options o = call.options(2);
  return {o.number("period"), o.number("low", -1), o.number("high", 1), o.number("duty", duty)};
}
int square(Call& call) {
  return push_signal(call, sysid::square(call.integer(1, "samples"), read_periodic(call, 0.5)));
}
int sawtooth(Call& call) {
  return push_signal(call, sysid::sawtooth(call.integer(1, "samples"), read_periodic(call, 1)));
}

/// A signal: a list, a column, or the only input (else output) of data.
Vec read_signal(Call& call, int i, double* Ts) {
  if (call.is<sysid::IdData>(i)) {
    const auto& d = call.object<sysid::IdData>(i, "d");
    const Mat& m = d.u.cols() ? d.u : d.y;
    if (m.cols() != 1)
      throw Error("the data have several inputs; give one signal: periodogram(d.u:slice(…))");
    if (Ts) *Ts = d.Ts;
    return m.col(0);
  }
  const Mat m = to_data(call.L, i, "u");
  if (m.cols() != 1) throw Error(text("u must be one signal, not a ", m.rows(), "×", m.cols(), " matrix"));
  return m.col(0);
}

int periodogram(Call& call) {
  double Ts = 1;
  const Vec u = read_signal(call, 1, &Ts);
  return call.push(std::make_shared<const sysid::Spectrum>(sysid::periodogram(u, call.number(2, "Ts", Ts))));
}
const sysid::Spectrum& spectrum(Call& call) { return call.object<sysid::Spectrum>(1, "spectrum"); }
int f(Call& call) { return push_signal(call, spectrum(call).f); }
int w(Call& call) { return push_signal(call, 2 * M_PI * spectrum(call).f); }
int power(Call& call) { return push_signal(call, spectrum(call).power); }
int mean_square(Call& call) { return call.push(spectrum(call).mean_square); }
int spectrum_text(Call& call) { return call.push(sysid::describe(spectrum(call))); }

int excitation(Call& call) {
  const Vec u = read_signal(call, 1, nullptr);
  const auto N = static_cast<double>(u.size());  // the cost is N limit²
  const auto limit = static_cast<long>(std::max(50.0, std::min(N / 2, std::sqrt(2e8 / std::max(N, 1.0)))));
  return call.push(sysid::excitation_order(u, static_cast<int>(call.integer(2, "limit", limit))));
}
int crest(Call& call) { return call.push(sysid::crest_factor(read_signal(call, 1, nullptr))); }

const OptionTable prbs_options = {
    {"order", "integer", "", "length of the shift register; without it as long as the samples need"},
    {"hold", "integer", "1", "samples that a bit lasts"},
    {"low", "number", "-1", "value of the bit 0"},
    {"high", "number", "1", "value of the bit 1"},
    {"seed", "integer", "1", "where the register begins"},
};
const OptionTable multisine_options = {
    {"lines", "list", "", "the periods in the record, by default 1 to samples/4"},
    {"amplitudes", "list", "", "one for each line; 1 by default"},
    {"phases", "string or list", "\"schroeder\"", "in rad, or how they are chosen", "schroeder|zero|random"},
    {"peak", "number", "1", "the largest value; 0: as the amplitudes say"},
    {"seed", "integer", "1", "of random phases"},
};
const OptionTable chirp_options = {
    {"from", "number", "", "the frequency at the beginning, in Hz"},
    {"to", "number", "", "the frequency at the end, in Hz"},
    {"Ts", "number", "1", "the sampling time, in s"},
    {"amplitude", "number", "1", "the largest value"},
    {"method", "string", "\"linear\"", "how the frequency runs", "linear|exponential"},
};
const OptionTable wave_options = {
    {"period", "number", "", "in samples"},
    {"duty", "number", "", "the part of a period that is high (square, 0.5) or rises (sawtooth, 1)"},
    {"low", "number", "-1", "the lowest value"},
    {"high", "number", "1", "the highest value"},
};

}  // namespace

extern const Module signals_module = {
    "signals",
    "Input signals for experiments",
    {
        {"prbs", prbs, "prbs(samples [, { order =, hold = 1, low = -1, high = 1, seed = 1 }]) -> column",
         R"(A pseudo-random binary sequence of a shift register of maximum length, every bit held for
            `hold` samples. Its period is hold (2^order - 1) samples; without an order the shortest that is
            not below `samples`.)",
         "u = prbs(15)  return sum(u), excitation_order(prbs(62, { order = 5 }))", "1.0 31", &prbs_options},
        {"multisine", multisine,
         R"(multisine(samples [, { lines =, amplitudes =, phases = "schroeder", peak = 1, seed = 1 }]) ->
            column)",
         R"(A sum of cosines at the lines k, which have k periods in the record (1 to samples/4 unless
            told). Schroeder's phases (or "zero", "random") keep the peak low.)",
         "u = multisine(64, { lines = {1, 3, 5} })  return excitation_order(u), crest_factor(u) < 2",
         "6 true", &multisine_options},
        {"chirp", chirp,
         R"(chirp(samples, { from =, to =, Ts = 1, amplitude = 1, method = "linear" }) -> column)",
         "A cosine whose frequency in Hz runs from one value to another, linearly or exponentially.",
         "chirp(4, { from = 0.25, to = 0.25 }).T", "1  0  -1  0", &chirp_options},
        {"square", square, "square(samples, { period =, duty = 0.5, low = -1, high = 1 }) -> column",
         "A square wave; the period in samples.", "square(4, { period = 2 }).T", "1  -1  1  -1",
         &wave_options},
        {"sawtooth", sawtooth, "sawtooth(samples, { period =, duty = 1, low = -1, high = 1 }) -> column",
         "A sawtooth that rises over the part `duty` of the period; 0.5 is a triangle.",
         "sum(sawtooth(8, { period = 4, low = 0, high = 4 }))", "12.0", &wave_options},
        {"periodogram", periodogram, "periodogram(u [, Ts = 1]) -> spectrum",
         R"(|U(ω)|² with U(ω) = N^(-1/2) Σ u(t) e^{-iωt} at the frequencies k/(N Ts). Its mean over all N
            is the mean square of u. u is a column, a list or data. Fields: .f in Hz, .w in rad/s, .power,
            .mean_square.)",
         "s = periodogram(multisine(8, { lines = {2}, peak = 0 }))  return s.f[3], s.power[3]", "0.25 2.0"},
        {"spectrum#f", f, "s.f -> column", "Frequencies in Hz."},
        {"spectrum#w", w, "s.w -> column", "Frequencies in rad/s."},
        {"spectrum#power", power, "s.power -> column", "|U(ω)|²."},
        {"spectrum#mean_square", mean_square, "s.mean_square -> number", "The mean square of the signal."},
        {"spectrum:__tostring", spectrum_text, "print(s)", "Size, mean square and the largest line."},
        {"excitation_order", excitation, "excitation_order(u [, limit]) -> integer",
         R"(The order of persistent excitation: as many parameters of an FIR model can be found from this
            input. Not looked for beyond limit (half the samples; at least 50, less in long records).)",
         "excitation_order(square(40, { period = 40 })), excitation_order({1, 1, 1, 1, 1, 1})", "20 1"},
        {"crest_factor", crest, "crest_factor(u) -> number", "The largest |u| over its root mean square.",
         "crest_factor({1, -1, 1})", "1.0"},
    }};

}  // namespace pendula::lua
