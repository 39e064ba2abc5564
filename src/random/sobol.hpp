// Points that fill the unit cube evenly: Sobol' and Halton sequences, with scrambling.
#pragma once

#include <cstdint>

namespace pendula::random {

enum class Scramble { none, digital, owen };

constexpr int most_sobol_dimensions = 512;  ///< the rows of joe_kuo.def

/// The 32 binary digits of coordinate `dimension` (from 0) of point `index` in the order of Gray codes, the
/// first digit in the highest bit.
/// requires  0 ≤ dimension < most_sobol_dimensions, index < 2³²
/// see       Joe & Kuo, SIAM J. Sci. Comput. 30(5), 2008; Bratley & Fox, ACM TOMS 14(1), 1988
std::uint32_t sobol_digits(std::uint64_t index, int dimension);

/// A coordinate of a Sobol' point in [0, 1), scrambled ones in (0, 1).
/// digital: one random shift per dimension, digit by digit. owen: nested uniform scrambling, in which the
/// permutation of a digit depends on all digits before it (Owen, Ann. Statist. 25(4), 1997). The
/// digits behind the 32nd are random.
double sobol(std::uint64_t index, int dimension, Scramble scramble, std::uint64_t seed);

/// A coordinate of a Halton point: the digits of index in the base of the dimension-th prime,
/// reflected at the point. Scrambled (either kind): every digit d of every dimension, also the zeros
/// that follow, becomes a d + c modulo the base, with a random factor a ≠ 0 and a random shift c
/// (Matoušek, J. Complexity 14(4), 1998).
double halton(std::uint64_t index, int dimension, Scramble scramble, std::uint64_t seed);

}  // namespace pendula::random
