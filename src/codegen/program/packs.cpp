#include "codegen/program/packs.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <unordered_map>

#include "expr/graph/operation.hpp"

namespace pendula::codegen {
namespace {

constexpr Slot width = Instruction::width;
constexpr Slot nothing = Program::elsewhere;
using Tuple = std::array<Slot, width>;

struct TupleHash {
  std::size_t operator()(const Tuple& t) const {
    std::size_t h = 0;
    for (Slot v : t) h = (h ^ v) * 1099511628211ULL;
    return h;
  }
};

bool is_packable(const Instruction& i) {
  if (i.part == Part::fused) return true;
  return i.part == Part::none && i.op != Op::solve && code_kind(i.op) == CodeKind::direct;
}
bool is_slow(const Instruction& i) { return i.part == Part::none && (i.op == Op::div || i.op == Op::sqrt); }
/// Do operands 0 and 1 commute?
bool commutes(const Instruction& i) { return i.part == Part::fused || i.op == Op::add || i.op == Op::mul; }

/// Hashes of the kinds of an operation and its operands, two levels deep; equal for equations of
/// the same shape.
class Shapes {
 public:
  explicit Shapes(const Program& p) {
    const Slot first = p.first_instruction();
    const std::size_t n = first + p.instructions.size();
    std::vector<std::uint64_t> kind(n, 1), one(n, 1);
    shape_.assign(n, 1);
    depth_.assign(n, 0);
    for (std::size_t k = 0; k < p.instructions.size(); ++k) {
      const Instruction& i = p.instructions[k];
      const std::size_t v = first + k;
      kind[v] = 2 + static_cast<std::uint64_t>(i.op) * 8 + static_cast<std::uint64_t>(i.part);
      one[v] = mixed(i, kind[v], kind);
      shape_[v] = mixed(i, kind[v], one);
      p.each_operand(i, [&](Slot o) { depth_[v] = std::max(depth_[v], depth_[o] + 1); });
    }
  }
  std::uint64_t of(Slot v) const { return shape_[v]; }
  Slot depth(Slot v) const { return depth_[v]; }
  Slot deepest() const { return depth_.empty() ? 0 : *std::max_element(depth_.begin(), depth_.end()); }

 private:
  static std::uint64_t mixed(const Instruction& i, std::uint64_t h, const std::vector<std::uint64_t>& of) {
    const auto add = [](std::uint64_t a, std::uint64_t b) { return (a ^ b) * 0x9e3779b97f4a7c15ULL; };
    const int n = i.operands();
    int k = 0;
    if (n >= 2 && commutes(i)) {
      h = add(h, of[i.operand[0]] + of[i.operand[1]]);
      k = 2;
    }
    for (; k < n; ++k) h = add(h, of[i.operand[k]]);
    return h;
  }
  std::vector<std::uint64_t> shape_;
  std::vector<Slot> depth_;
};

class Packing {
 public:
  Packing(const Program& program, const Shapes& shapes, Slot stride)
      : p_(program), shapes_(shapes), stride_(stride) {
    const std::size_t n = p_.first_instruction() + p_.instructions.size();
    scalar_.assign(n, nothing);
    lane_.assign(n, {nothing, 0});
    out_.inputs = p_.inputs;
    out_.constants = p_.constants;
    for (Slot v = 0; v < p_.first_instruction(); ++v) scalar_[v] = v;
    windows_ = find_windows();
  }

  bool has_windows() const { return !windows_.empty(); }

  Program result() && {
    std::vector<Slot> value(p_.results.size(), nothing);
    std::vector<char> written(p_.results.size(), 0);
    for (Slot first : windows_) {
      const Slot wide = pack(window(first));
      if (stride_ == 1) {
        out_.wide_results.push_back({wide, first});
        std::fill_n(written.begin() + first, width, 1);
        continue;
      }
      for (Slot l = 0; l < width; ++l) {
        const Slot k = first + l * stride_;
        if (value[k] == nothing) value[k] = component(wide, l);
      }
    }
    for (std::size_t k = 0; k < value.size(); ++k)
      if (value[k] == nothing && !written[k]) value[k] = scalar(p_.results[k]);
    out_.results = std::move(value);
    put_constants_in_place();
    return std::move(out_);
  }

 private:
  struct Lane {
    Slot pack, which;
  };
  bool is_leaf(Slot v) const { return v < p_.first_instruction(); }
  bool is_known(Slot v) const { return scalar_[v] != nothing || lane_[v].pack != nothing; }

  Tuple window(Slot first) const {
    Tuple t;
    for (Slot l = 0; l < width; ++l) t[l] = p_.results[first + l * stride_];
    return t;
  }
  bool is_window(Slot first) const {
    if (first + (width - 1) * stride_ >= p_.results.size()) return false;
    const Tuple t = window(first);
    for (Slot l = 0; l < width; ++l) {
      if (is_leaf(t[l]) || !is_packable(p_.of(t[l])) || shapes_.of(t[l]) != shapes_.of(t[0])) return false;
      if (std::count(t.begin(), t.end(), t[l]) > 1) return false;
    }
    return true;
  }
  /// Groups of four outputs of one shape. If two or three are left at the end of a row, the last group
  /// overlaps the one before.
  std::vector<Slot> find_windows() const {
    std::vector<Slot> list;
    std::vector<char> done(p_.results.size(), 0);
    const auto take = [&](Slot first) {
      list.push_back(first);
      for (Slot l = 0; l < width; ++l) done[first + l * stride_] = 1;
    };
    const auto fresh = [&](Slot first) {
      Slot count = 0;
      for (Slot l = 0; l < width; ++l) count += !done[first + l * stride_];
      return count;
    };
    for (Slot k = 0; k < p_.results.size(); ++k)
      if (!done[k] && is_window(k) && fresh(k) == width) take(k);
    for (Slot k = 0; k < p_.results.size(); ++k)
      for (Slot back = 1; back < width - 1 && !done[k]; ++back)
        if (k >= back * stride_ && is_window(k - back * stride_) && fresh(k - back * stride_) >= 2)
          take(k - back * stride_);
    return list;
  }

  Slot put(const Instruction& i) {
    out_.instructions.push_back(i);
    return out_.first_instruction() + static_cast<Slot>(out_.instructions.size()) - 1;
  }
  Slot component(Slot wide, Slot which) {
    return put({.op = Op::solve, .part = Part::component, .operand = {wide, which, 0}});
  }

  /// The value as one number.
  Slot scalar(Slot v) {
    if (scalar_[v] != nothing) return scalar_[v];
    if (lane_[v].pack != nothing) return scalar_[v] = component(lane_[v].pack, lane_[v].which);
    Instruction i = p_.of(v);
    const int n = i.operands();
    for (int k : deepest_first(i, n)) i.operand[k] = scalar(i.operand[k]);
    std::vector<Slot> extra;
    for (int k = 0; k < i.extras(); ++k)
      extra.push_back(scalar(p_.extra[i.first_extra + static_cast<Slot>(k)]));
    i.first_extra = static_cast<Slot>(out_.extra.size());
    out_.extra.insert(out_.extra.end(), extra.begin(), extra.end());
    return scalar_[v] = put(i);
  }

  /// Operands by decreasing depth, so that each term of a long sum is added when it is available.
  std::vector<int> deepest_first(const Instruction& i, int n) const {
    std::vector<int> order;
    for (int k = 0; k < n; ++k) order.push_back(k);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return shapes_.depth(i.operand[a]) > shapes_.depth(i.operand[b]); });
    return order;
  }

  bool is_constant(Slot v) const { return v >= p_.inputs && is_leaf(v); }
  /// Places the constants of the four lanes side by side; their slots are known at the end of the program.
  Tuple side_by_side(const Tuple& t) {
    Tuple row;
    for (Slot l = 0; l < width; ++l) {
      row[l] = later + static_cast<Slot>(added_.size());
      added_.push_back(p_.constants[t[l] - p_.inputs]);
    }
    return row;
  }
  void put_constants_in_place() {
    const Slot first = p_.first_instruction(), count = static_cast<Slot>(added_.size());
    const auto place = [&](Slot& v) {
      if (v == nothing) return;
      if (v >= later)
        v = first + (v - later);
      else if (v >= first)
        v += count;
    };
    out_.constants.insert(out_.constants.end(), added_.begin(), added_.end());
    for (Instruction& i : out_.instructions)
      for (int k = 0; k < i.operands(); ++k) place(i.operand[k]);
    for (Slot& v : out_.extra) place(v);
    for (Slot& v : out_.results) place(v);
    for (Program::WideResult& r : out_.wide_results) place(r.value);
  }

  Slot gather(const Tuple& t) {
    Tuple from;
    const bool same = std::count(t.begin(), t.end(), t[0]) == width;
    if (!same && std::all_of(t.begin(), t.end(), [&](Slot v) { return is_constant(v); }))
      from = side_by_side(t);
    else
      for (Slot l = 0; l < width; ++l) from[l] = scalar(t[l]);
    const auto first = static_cast<Slot>(out_.extra.size());
    out_.extra.insert(out_.extra.end(), from.begin(), from.end());
    return put({.op = Op::add, .part = Part::gather, .wide = true, .first_extra = first});
  }

  /// The four values packed into a wide one.
  Slot pack(const Tuple& t) {
    if (const auto known = packs_.find(t); known != packs_.end()) return known->second;
    const Slot made = is_operation(t) ? operation(t) : gather(t);
    packs_.emplace(t, made);
    return made;
  }

  bool is_operation(const Tuple& t) const {
    if (std::count(t.begin(), t.end(), t[0]) == width) return false;
    const Instruction* first = is_leaf(t[0]) ? nullptr : &p_.of(t[0]);
    const bool alike = first && std::all_of(t.begin(), t.end(), [&](Slot v) {
                         return !is_leaf(v) && is_packable(p_.of(v)) && p_.of(v).op == first->op &&
                                p_.of(v).part == first->part;
                       });
    if (!alike) return false;
    return is_quick(t) || !std::all_of(t.begin(), t.end(), [&](Slot v) { return is_known(v); });
  }
  /// Squares of adjacent inputs: recomputing them is faster than packing them.
  bool is_quick(const Tuple& t) const {
    const Instruction& first = p_.of(t[0]);
    if (is_slow(first)) return false;
    for (int k = 0; k < first.operands(); ++k) {
      const Slot v = first.operand[k];
      if (!is_leaf(v)) return false;
      for (Slot l = 1; l < width; ++l) {
        const Slot w = p_.of(t[l]).operand[k];
        if (w != v && !(w == v + l && w < p_.inputs)) return false;
      }
    }
    return true;
  }

  Slot operation(const Tuple& t) {
    Instruction i = p_.of(t[0]);
    std::array<Tuple, 3> operand{};
    for (Slot l = 0; l < width; ++l) {
      const Instruction& from = p_.of(t[l]);
      const bool swap = l > 0 && commutes(from) && changes_places(i, from, l);
      for (int k = 0; k < i.operands(); ++k) operand[k][l] = from.operand[swap && k < 2 ? 1 - k : k];
    }
    for (int k : deepest_first(p_.of(t[0]), i.operands())) i.operand[k] = pack(operand[k]);
    i.wide = true;
    const Slot wide = put(i);
    for (Slot l = 0; l < width; ++l)
      if (!is_known(t[l])) lane_[t[l]] = {wide, l};
    return wide;
  }

  /// Do the operands of a lane have to be exchanged to match the first lane, by their shape or by
  /// adjacency of inputs?
  bool changes_places(const Instruction& first, const Instruction& i, Slot l) const {
    const Slot a = i.operand[0], b = i.operand[1], a0 = first.operand[0], b0 = first.operand[1];
    const auto same = [&](Slot v, Slot w) {
      return is_leaf(v) == is_leaf(w) && shapes_.of(v) == shapes_.of(w);
    };
    if (!same(a, a0) || !same(b, b0)) return same(b, a0) && same(a, b0);
    const auto fits = [l](Slot v, Slot w) { return v == w || v == w + l; };
    return !fits(a, a0) && !fits(b, b0) && (fits(b, a0) || fits(a, b0));
  }

  const Program& p_;
  const Shapes& shapes_;
  Slot stride_;
  std::vector<Slot> windows_;
  Program out_;
  static constexpr Slot later = 0x8000'0000u;
  std::vector<double> added_;
  std::vector<Slot> scalar_;
  std::vector<Lane> lane_;
  std::unordered_map<Tuple, Slot, TupleHash> packs_;
};

/// Candidate distances between outputs of one shape: 1; the most frequent period of the unknowns; 2 and 3 for
/// points in the plane and in space, whose coordinates have one shape.
std::vector<Slot> strides(const Program& p, const Shapes& shapes) {
  std::unordered_map<std::uint64_t, Slot> last;
  std::map<Slot, int> count;
  for (Slot k = 0; k < p.results.size(); ++k) {
    const auto [at, made] = last.try_emplace(shapes.of(p.results[k]), k);
    if (!made) ++count[k - std::exchange(at->second, k)];
  }
  std::vector<Slot> list{1, 2, 3};
  for (Slot known : list) count.erase(known);
  const auto most = std::max_element(count.begin(), count.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most != count.end() && most->second >= static_cast<int>(width) - 1)
    list.insert(list.begin() + 1, most->first);
  return list;
}

}  // namespace

/// Estimated cycles. A wide root or division occupies the divider twice as long as a scalar one; a gather
/// takes a load or insertion per lane.
double cycles(const Program& p) {
  constexpr double slow = 4.5, wide_slow = 9, insertions = 5;
  double sum = 0;
  for (const Instruction& i : p.instructions) {
    if (i.part == Part::gather) {
      const Slot* e = p.extra.data() + i.first_extra;
      bool same = true, row = true;
      for (Slot k = 1; k < width; ++k) {
        same = same && e[k] == e[0];
        row = row && e[k] == e[0] + k &&
              (e[k] < p.inputs || (e[0] >= p.inputs && e[k] < p.first_instruction()));
      }
      sum += same || row ? 1 : insertions;
    } else if (i.part != Part::component) {
      sum += is_slow(i) ? (i.wide ? wide_slow : slow) : 1;
    }
  }
  return sum;
}

Program packed(const Program& program) {
  constexpr std::size_t fewest = 24;  // instructions
  constexpr Slot deepest = 3'000;     // of a recursion
  constexpr double worth_it = 0.85, good = 0.5;
  const std::size_t size = program.instructions.size();
  if (size < fewest || size > longest_packed || program.results.size() < width) return program;
  if (std::any_of(program.instructions.begin(), program.instructions.end(),
                  [](const Instruction& i) { return i.wide; }))
    return program;
  const Shapes shapes(program);
  if (shapes.deepest() > deepest) return program;
  std::optional<Program> best;
  const double all = cycles(program);
  double least = worth_it * all;
  for (Slot stride : strides(program, shapes)) {
    Packing packing(program, shapes, stride);
    if (!packing.has_windows()) continue;
    Program found = std::move(packing).result();
    const double now = cycles(found);
    if (now >= least) continue;
    least = now;
    best = std::move(found);
    if (now < good * all) break;
  }
  return best ? *std::move(best) : program;
}

}  // namespace pendula::codegen
