// Input signals for experiments, and their spectra. All are deterministic: the same
// call gives the same samples.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"

namespace pendula::sysid {

/// A pseudo-random binary sequence: a shift register of maximum length, period 2^order - 1, whose
/// every bit is held for `hold` samples (Ljung, System Identification, 2nd ed., §13.3; Golomb, Shift
/// Register Sequences). Over a period the autocorrelation is 1 and -1/(2^order - 1): persistently
/// exciting of order 2^order - 1.
struct Prbs {
  std::optional<int>
      order;  ///< 2 … 24; none: the shortest register whose period is not below the number of samples
  int hold = 1;
  double low = -1, high = 1;
  long seed = 1;  ///< contents of the register, not 0 modulo 2^order
};
Vec prbs(long samples, const Prbs& options = {});

/// Σ aₖ cos(2πkt/N + φₖ), t = 0 … N-1, over the lines k; persistently exciting of order 2·(number of lines)
/// (a line at k = N/2 counts once). Schroeder's phases φₖ = -π j(j-1)/K keep the crest factor low (IEEE
/// Trans. Inform. Theory 16(1), 1970).
struct Multisine {
  std::vector<long> lines;           ///< 1 … N/2; empty: 1 … N/4
  std::vector<double> amplitudes;    ///< empty: equal
  std::string phases = "schroeder";  ///< or "zero", "random" (seeded)
  double peak = 1;                   ///< the largest |u|; 0: amplitudes as given
  long seed = 1;
};
Vec multisine(long samples, const Multisine& options = {});

/// a cos(2π∫f dt + φ), the frequency f in Hz growing from `from` to `to` over the
/// signal, linearly or exponentially.
struct Chirp {
  double from = 0, to = 0, Ts = 1, amplitude = 1;
  bool exponential = false;
};
Vec chirp(long samples, const Chirp& options);

/// Between low and high with a period in samples; square: `duty` of the period high;
/// sawtooth: rises over `duty`.
struct Periodic {
  double period = 0, low = -1, high = 1, duty = 0.5;
};
Vec square(long samples, const Periodic& options);
Vec sawtooth(long samples, const Periodic& options);

/// max |u| / root mean square
double crest_factor(const Vec& u);

/// |U(ω)|² with U(ω) = N^{-1/2} Σ u(t) e^{-iωt} at ω = 2πk/(N Ts), k = 0 … N/2 (Ljung, eq. (2.37)). The mean
/// over all N frequencies is the mean square of u (Parseval). Cost: O(N log N) for every N (Bluestein).
struct Spectrum {
  Vec f, power;  ///< f in Hz
  double mean_square = 0, Ts = 1;
  long samples = 0;
};
Spectrum periodogram(const Vec& u, double Ts);
std::string describe(const Spectrum& s);

/// Order of persistent excitation of a signal (excitation.hpp).
int excitation_order(const Vec& u, int limit);

}  // namespace pendula::sysid
