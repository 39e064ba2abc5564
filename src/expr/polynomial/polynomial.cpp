#include "expr/polynomial/polynomial.hpp"

#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <flint/fmpq_mpoly_factor.h>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/polynomial/exact_memory.hpp"

namespace pendula {
namespace {

struct Library {
  /// FLINT prints and aborts when memory is exhausted, and allocates to print; the allocation functions
  /// of GMP throw.
  Library() {
    if (!handle) return;
    const auto all_zero = [](size_t n, size_t size) {
      return std::memset(exact_memory::allocate(n * size), 0, n * size);
    };
    function(static_cast<decltype(&__flint_set_memory_functions)>(nullptr), "__flint_set_memory_functions")(
        exact_memory::allocate, all_zero,
        [](void* old, size_t size) { return exact_memory::reallocate(old, 0, size); }, std::free);
  }
#ifdef PENDULA_FLINT
  void* handle = dlopen(PENDULA_FLINT, RTLD_NOW | RTLD_LOCAL);
  static constexpr const char* remedy =
      PENDULA_FLINT ", which is not installed (Debian: apt-get install libflint17)";
#else
  void* handle = nullptr;
  static constexpr const char* remedy = "FLINT, which this program was built without (-DPENDULA_FLINT=OFF)";
#endif
  template <class F>
  F* function(F*, const char* name) const {
    void* address = handle ? dlsym(handle, name) : nullptr;
    if (!address) throw Error(text("common factors of polynomials need the library ", remedy));
    return reinterpret_cast<F*>(address);
  }
};

const Library& library() {
  static const Library library;
  return library;
}

/// The function of FLINT of this name, looked up once.
#define FLINT(name)                                                                                 \
  ([] {                                                                                             \
    static auto* const function = library().function(static_cast<decltype(&name)>(nullptr), #name); \
    return function;                                                                                \
  }())

/// A rational number of FLINT.
class Rational {
 public:
  Rational() { FLINT(fmpq_init)(value); }
  explicit Rational(const mpq_class& q) : Rational() { FLINT(fmpq_set_mpq)(value, q.get_mpq_t()); }
  ~Rational() { FLINT(fmpq_clear)(value); }
  Rational(const Rational&) = delete;
  Rational& operator=(const Rational&) = delete;
  mpq_class get() const {
    mpq_class q;
    FLINT(fmpq_get_mpq)(q.get_mpq_t(), value);
    return q;
  }
  fmpq_t value;
};

}  // namespace

bool have_polynomials() { return library().handle != nullptr; }
void require_polynomials() { FLINT(fmpq_init); }

class PolynomialRing {
 public:
  explicit PolynomialRing(std::size_t n) : generators(n) {
    FLINT(fmpq_mpoly_ctx_init)(context, static_cast<slong>(n), ORD_LEX);
  }
  ~PolynomialRing() { FLINT(fmpq_mpoly_ctx_clear)(context); }
  PolynomialRing(const PolynomialRing&) = delete;
  PolynomialRing& operator=(const PolynomialRing&) = delete;
  std::size_t generators;
  mutable fmpq_mpoly_ctx_t context;
};

RingPtr polynomial_ring(std::size_t generators) { return std::make_shared<const PolynomialRing>(generators); }

struct Polynomial::Held {
  explicit Held(RingPtr of) : ring(std::move(of)) { FLINT(fmpq_mpoly_init)(value, ring->context); }
  ~Held() { FLINT(fmpq_mpoly_clear)(value, ring->context); }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  slong length() const { return value->zpoly->length; }
  RingPtr ring;
  mutable fmpq_mpoly_t value;
};

Polynomial::Polynomial(RingPtr ring, const std::vector<Monomial>& terms) {
  auto made = std::make_shared<Held>(std::move(ring));
  for (const Monomial& t : terms) {
    const Rational c(t.coefficient);
    FLINT(fmpq_mpoly_push_term_fmpq_ui)(made->value, c.value, t.exponents.data(), made->ring->context);
  }
  FLINT(fmpq_mpoly_sort_terms)(made->value, made->ring->context);
  FLINT(fmpq_mpoly_combine_like_terms)(made->value, made->ring->context);
  held_ = std::move(made);
}

Polynomial Polynomial::constant(RingPtr ring, const mpq_class& value) {
  const std::size_t n = ring->generators;
  return Polynomial(std::move(ring), {{value, std::vector<unsigned long>(n, 0)}});
}

std::vector<Monomial> Polynomial::terms() const {
  std::vector<Monomial> list;
  for (slong i = 0; i < held_->length(); ++i) {
    Rational c;
    FLINT(fmpq_mpoly_get_term_coeff_fmpq)(c.value, held_->value, i, held_->ring->context);
    Monomial t{c.get(), std::vector<unsigned long>(held_->ring->generators)};
    FLINT(fmpq_mpoly_get_term_exp_ui)(t.exponents.data(), held_->value, i, held_->ring->context);
    list.push_back(std::move(t));
  }
  return list;
}

std::size_t Polynomial::size() const { return static_cast<std::size_t>(held_->length()); }
bool Polynomial::is_one() const { return FLINT(fmpq_mpoly_is_one)(held_->value, held_->ring->context) != 0; }
bool Polynomial::is_constant() const { return total_degree() <= 0; }
long Polynomial::total_degree() const {
  return FLINT(fmpq_mpoly_total_degree_si)(held_->value, held_->ring->context);
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  auto made = std::make_shared<Polynomial::Held>(a.held_->ring);
  FLINT(fmpq_mpoly_add)(made->value, a.held_->value, b.held_->value, made->ring->context);
  return Polynomial(std::move(made));
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  auto made = std::make_shared<Polynomial::Held>(a.held_->ring);
  FLINT(fmpq_mpoly_mul)(made->value, a.held_->value, b.held_->value, made->ring->context);
  return Polynomial(std::move(made));
}

Polynomial Polynomial::power(unsigned long n) const {
  auto made = std::make_shared<Held>(held_->ring);
  if (!FLINT(fmpq_mpoly_pow_ui)(made->value, held_->value, n, made->ring->context))
    throw Error(text("a polynomial to the power ", n, " is too long to be written out"));
  return Polynomial(std::move(made));
}

std::optional<Polynomial> gcd(const Polynomial& a, const Polynomial& b) {
  auto made = std::make_shared<Polynomial::Held>(a.held_->ring);
  if (!FLINT(fmpq_mpoly_gcd)(made->value, a.held_->value, b.held_->value, made->ring->context)) return {};
  return Polynomial(std::move(made));
}

std::optional<Polynomial> quotient(const Polynomial& a, const Polynomial& b) {
  auto made = std::make_shared<Polynomial::Held>(a.held_->ring);
  if (!FLINT(fmpq_mpoly_divides)(made->value, a.held_->value, b.held_->value, made->ring->context)) return {};
  return Polynomial(std::move(made));
}

Polynomial remainder(const Polynomial& a, std::span<const Polynomial> basis) {
  if (basis.empty()) return a;
  const RingPtr& ring = a.held_->ring;
  auto made = std::make_shared<Polynomial::Held>(ring);
  std::vector<std::unique_ptr<Polynomial::Held>> quotients;
  std::vector<fmpq_mpoly_struct*> q, divisors;
  for (const Polynomial& b : basis) {
    quotients.push_back(std::make_unique<Polynomial::Held>(ring));
    q.push_back(quotients.back()->value);
    divisors.push_back(b.held_->value);
  }
  FLINT(fmpq_mpoly_divrem_ideal)
  (q.data(), made->value, a.held_->value, divisors.data(), static_cast<slong>(divisors.size()),
   ring->context);
  return Polynomial(std::move(made));
}

std::optional<Polynomial::Factors> Polynomial::factors() const {
  struct List {
    explicit List(const RingPtr& of) : ring(of) { FLINT(fmpq_mpoly_factor_init)(value, ring->context); }
    ~List() { FLINT(fmpq_mpoly_factor_clear)(value, ring->context); }
    const RingPtr& ring;
    fmpq_mpoly_factor_t value;
  } list(held_->ring);
  const auto& context = held_->ring->context;
  if (!FLINT(fmpq_mpoly_factor)(list.value, held_->value, context)) return {};
  Rational c;
  FLINT(fmpq_mpoly_factor_get_constant_fmpq)(c.value, list.value, context);
  Factors result{c.get(), {}};
  for (slong i = 0; i < list.value->num; ++i) {
    auto base = std::make_shared<Held>(held_->ring);
    FLINT(fmpq_mpoly_factor_get_base)(base->value, list.value, i, context);
    const slong n = FLINT(fmpq_mpoly_factor_get_exp_si)(list.value, i, context);
    result.powers.emplace_back(Polynomial(std::move(base)), static_cast<unsigned long>(n));
  }
  return result;
}

#undef FLINT

}  // namespace pendula
