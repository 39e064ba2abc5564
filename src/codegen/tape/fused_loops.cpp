#include "codegen/tape/fused_loops.hpp"

#include <algorithm>
#include <optional>

namespace pendula::codegen {
namespace {

constexpr Slot longest_shift = 64;

class Fusion {
 public:
  Fusion(const std::vector<Item>& items, const std::vector<Slot>& owner) : items_(items), owner_(owner) {
    const std::size_t n = items.size();
    t_.time.assign(n, 0);
    t_.loop.assign(n, 0);
    t_.shift.assign(n, 0);
    t_.local.assign(n, 0);
    for (std::size_t i = 0; i < n; ++i) items[i].is_loop ? place_piece(i) : place_other(i);
    t_.loops = static_cast<Slot>(loops_.size());
  }

  Timing result(const std::vector<Slot>& kept) && {
    for (std::size_t i = 0; i < items_.size(); ++i) t_.local[i] = items_[i].is_loop;
    const auto outside = [&](Slot slot) {
      if (owner_[slot] != no_owner) t_.local[owner_[slot]] = 0;
    };
    std::for_each(kept.begin(), kept.end(), outside);
    for (std::size_t i = 0; i < items_.size(); ++i) {
      std::for_each(items_[i].reads.begin(), items_[i].reads.end(), outside);
      if (items_[i].is_loop)
        for (int k = 0; k < 2; ++k)
          if (!reads_in_step(i, k)) outside(items_[i].loop.operand[k]);
    }
    return std::move(t_);
  }

 private:
  struct Group {
    Slot time, count;
  };

  Slot maker(Slot slot) const { return owner_[slot]; }

  /// Is the operand computed by the same loop in the same step?
  bool reads_in_step(std::size_t i, int k) const {
    const VectorLoop& p = items_[i].loop;
    const Slot from = maker(p.operand[k]);
    if (from == no_owner) return true;
    return items_[from].is_loop && t_.time[from] == t_.time[i] && t_.loop[from] == t_.loop[i] &&
           p.stride[k] == 1 && t_.shift[from] + (p.operand[k] - items_[from].result) == t_.shift[i];
  }

  void place_other(std::size_t i) {
    Slot time = 0;
    for (Slot slot : items_[i].reads)
      if (const Slot from = maker(slot); from != no_owner) {
        const Slot then = t_.time[from];
        time = std::max(time, then + then % 2);
      }
    t_.time[i] = time;
  }

  void place_piece(std::size_t i) {
    const VectorLoop& p = items_[i].loop;
    Slot time = 1;
    for (Slot slot : p.operand)
      if (const Slot from = maker(slot); from != no_owner)
        time = std::max(time, t_.time[from] + (t_.time[from] + 1) % 2);
    std::optional<Slot> loop = last_member_of_loop(i, time);
    if (loop && !join(i, *loop, time)) {
      time += 2;
      loop.reset();
    }
    if (!loop) {
      loop = fitting(time, p.count);
      if (!loop) {
        loops_.push_back({time, p.count});
        loop = static_cast<Slot>(loops_.size() - 1);
        at_time_.resize(std::max<std::size_t>(at_time_.size(), time + 1));
        at_time_[time].push_back(*loop);
      }
    }
    t_.time[i] = time;
    t_.loop[i] = *loop;
  }

  /// The loop at this time that computes an operand.
  std::optional<Slot> last_member_of_loop(std::size_t i, Slot time) const {
    for (Slot slot : items_[i].loop.operand)
      if (const Slot from = maker(slot); from != no_owner && t_.time[from] == time) return t_.loop[from];
    return std::nullopt;
  }

  /// Can item i join this loop, which computes at least one of its operands? Sets its shift.
  bool join(std::size_t i, Slot loop, Slot time) {
    const VectorLoop& p = items_[i].loop;
    if (!similar(loops_[loop].count, p.count)) return false;
    Slot shift = 0;
    for (int k = 0; k < 2; ++k) {
      const Slot from = maker(p.operand[k]);
      if (from == no_owner || t_.time[from] != time) continue;
      if (t_.loop[from] != loop || p.stride[k] != 1) return false;
      shift = std::max(shift, t_.shift[from] + (p.operand[k] - items_[from].result));
    }
    if (shift > longest_shift) return false;
    t_.shift[i] = shift;
    return true;
  }

  std::optional<Slot> fitting(Slot time, Slot count) const {
    if (time < at_time_.size())
      for (Slot loop : at_time_[time])
        if (similar(loops_[loop].count, count)) return loop;
    return std::nullopt;
  }
  static bool similar(Slot a, Slot b) { return std::max(a, b) - std::min(a, b) <= 8 + a / 16; }

  const std::vector<Item>& items_;
  const std::vector<Slot>& owner_;
  std::vector<Group> loops_;
  std::vector<std::vector<Slot>> at_time_;
  Timing t_;
};

}  // namespace

Timing fuse(const std::vector<Item>& items, const std::vector<Slot>& owner, const std::vector<Slot>& kept) {
  return Fusion(items, owner).result(kept);
}

void run_loop(const FusedLoop& loop, Slot inputs, const double* in, double* w) {
  for (Slot begin = 0; begin < loop.steps; begin += loop.chunk) {
    const Slot end = begin + loop.chunk;
    for (const FusedOperation& s : loop.operations) {
      const VectorLoop& p = s.loop;
      const Slot first = std::max(begin, s.shift) - s.shift,
                 last = std::min(std::max(end, s.shift) - s.shift, p.count);
      if (first >= last) continue;
      const Slot local = first + s.shift - begin;  // in a buffer
      const auto operand = [&](int k) -> const double* {
        if (s.local_operand[k]) return w + p.operand[k] + local;
        return (p.operand[k] < inputs ? in : w) + p.operand[k] + std::size_t{first} * p.stride[k];
      };
      run_members(p, last - first, {operand(0), operand(1), w + p.result + (s.local_result ? local : first)});
    }
  }
}

}  // namespace pendula::codegen
