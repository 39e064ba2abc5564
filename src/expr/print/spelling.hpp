// Names as they are typed: what a screen shows as θ₁′ is theta1' on a keyboard.
#pragma once

#include <string>

namespace pendula {

/// The one plain spelling of a name, whichever of its spellings is given: θ₁′, theta1', theta[1].dot and
/// theta_1_dot are all theta1'. Greek letters become their names, subscripts digits,
/// primes and ".dot" quotes.
std::string plain_spelling(const std::string& name);

}  // namespace pendula
