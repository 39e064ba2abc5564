#include "integrate/sweep/ensemble.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/interrupt.hpp"

namespace pendula::integrate {

bool EnsembleClient::rejects(int, int, const Point&, const Point&, const double*) { return false; }

Ensemble::Ensemble(std::shared_ptr<const CompiledLaneStep> code, EnsemblePlan plan)
    : code_(std::move(code)),
      plan_(std::move(plan)),
      W_(code_->lanes()),
      n_(code_->n()),
      p_(code_->parameters()),
      rounding_(4 * std::numeric_limits<double>::epsilon() *
                std::max(std::fabs(plan_.from), std::fabs(plan_.to))) {
  const auto W = static_cast<std::size_t>(W_), n = static_cast<std::size_t>(n_);
  const std::size_t size = static_cast<std::size_t>(code_->size()) * W;
  const std::size_t changing = static_cast<std::size_t>(code_->changing()) * W;
  state_.assign(size, 0);
  ready_.assign(size, 0);
  out_.assign(changing + W, 0);
  ready_out_.assign(changing, 0);
  between_.assign((2 + 2 * n + static_cast<std::size_t>(p_)) * W, 0);
  between_out_.assign(2 * n * W, 0);
  work_.assign(code_->workspace_size(), 0);
  row_.assign(2 * n + static_cast<std::size_t>(p_), 0);
  set_.assign(W, no_set);
  place_.assign(W, 0);
  ready_set_.assign(W, no_set);
  next_ready_ = W_;
  for (Numbers* numbers : {&state_, &ready_})
    for (int l = 0; l < W_; ++l) {
      at(*numbers, lane::t, l) = plan_.from;
      at(*numbers, code_->of(lane::end), l) = plan_.to;
      at(*numbers, code_->of(lane::dt_max), l) = plan_.dt_max;
      at(*numbers, code_->of(lane::dt_first), l) = plan_.dt_first;
      at(*numbers, code_->of(lane::most_steps), l) = plan_.most_steps;
      for (int k = 0; k < n_; ++k) {
        at(*numbers, code_->rtol() + k, l) = plan_.rtol[k];
        at(*numbers, code_->atol() + k, l) = plan_.atol[k];
      }
    }
  wanted_.reserve(W);
  done_.reserve(2 * W);
}

/// Starts up to one set per lane; false if there is none left.
bool Ensemble::prepare_starts(EnsembleClient& client) {
  next_ready_ = 0;
  for (int l = 0; l < W_; ++l) {
    const auto set = client.next(row_.data(), row_.data() + n_);
    if (!set) {
      std::fill(ready_set_.begin() + l, ready_set_.end(), no_set);
      break;
    }
    ready_set_[l] = *set;
    for (int k = 0; k < n_; ++k) at(ready_, code_->x() + k, l) = row_[k];
    for (int k = 0; k < p_; ++k) at(ready_, code_->p() + k, l) = row_[n_ + k];
  }
  if (ready_set_[0] == no_set) return false;
  code_->start(ready_.data(), ready_out_.data(), work_.data());
  return true;
}

void Ensemble::report_point(EnsembleClient& client, const Numbers& from, int first, int l,
                            const Numbers& p_from, int p_first, int set, std::optional<int> place, double t) {
  double* to = row_.data();
  for (int k = 0; k < 2 * n_; ++k) *to++ = from[(first + k) * W_ + l];
  for (int k = 0; k < p_; ++k) *to++ = p_from[(p_first + k) * W_ + l];
  client.point(set, place, t, row_.data(), row_.data() + n_, row_.data() + 2 * n_);
}

void Ensemble::set_next_stop(int l) {
  const auto place = static_cast<std::size_t>(place_[l]);
  at(state_, code_->of(lane::next_stop), l) =
      place < plan_.times.size() ? std::min(plan_.times[place] - rounding_, plan_.to) : plan_.to;
}

/// Idles a lane without a set by steps of length 0.
void Ensemble::rest(int l) {
  set_[l] = no_set;
  at(state_, code_->of(lane::end), l) = at(state_, lane::t, l);
  at(state_, lane::repeated, l) = 0;
}

/// Loads the next set that can be started into the lane.
void Ensemble::load(EnsembleClient& client, int l) {
  for (;;) {
    if (next_ready_ == W_ || ready_set_[next_ready_] == no_set)
      if (exhausted_ || !prepare_starts(client)) {
        exhausted_ = true;
        next_ready_ = W_;
        return rest(l);
      }
    const int from = next_ready_++;
    const int set = ready_set_[from];
    double check = at(ready_out_, lane::dt, from) * 0;
    for (int k = 0; k < n_; ++k)
      check += (at(ready_out_, code_->x() + k, from) + at(ready_out_, code_->xdot() + k, from)) * 0;
    if (check != 0) {  // NaN
      client.abandoned(set);
      continue;
    }
    for (int k = 0; k < code_->changing(); ++k) at(state_, k, l) = at(ready_out_, k, from);
    for (int k = 0; k < p_; ++k) at(state_, code_->p() + k, l) = at(ready_, code_->p() + k, from);
    at(state_, code_->of(lane::end), l) = plan_.to;
    set_[l] = set;
    int& place = place_[l] = 0;
    for (; place < static_cast<int>(plan_.times.size()); ++place) {
      const double t = plan_.times[place];
      if (t > plan_.from + rounding_) break;
      report_point(client, state_, code_->x(), l, state_, code_->p(), set, place, t);
    }
    return set_next_stop(l);
  }
}

void Ensemble::add_between(EnsembleClient& client, int l, int place, double t) {
  const int to = static_cast<int>(wanted_.size());
  wanted_.push_back({set_[l], place, t});
  at(between_, 0, to) = t - at(state_, lane::t, l);
  at(between_, 1, to) = at(state_, lane::t, l);
  for (int k = 0; k < 2 * n_; ++k) at(between_, 2 + k, to) = at(state_, code_->x() + k, l);
  for (int k = 0; k < p_; ++k) at(between_, 2 + 2 * n_ + k, to) = at(state_, code_->p() + k, l);
  if (to + 1 == W_) flush(client);
}

void Ensemble::flush(EnsembleClient& client) {
  if (!wanted_.empty()) code_->between(between_.data(), between_out_.data(), work_.data());
  for (std::size_t l = 0; l < wanted_.size(); ++l)
    report_point(client, between_out_, 0, static_cast<int>(l), between_, 2 + 2 * n_, wanted_[l].set,
                 wanted_[l].place, wanted_[l].t);
  wanted_.clear();
  for (const Done& done : done_) client.finished(done.set, done.stats);
  done_.clear();
}

/// Handles a lane that needs attention; state_ is the beginning of its step, out_ the end.
void Ensemble::handle_lane(EnsembleClient& client, int l, std::vector<int>& free) {
  const auto lane_number = static_cast<std::size_t>(l);
  const int set = set_[lane_number];
  const double from = at(state_, lane::t, l), t = at(out_, lane::t, l);
  const double steps = at(out_, lane::steps, l);
  if (t > from) {
    int& place = place_[lane_number];
    for (; place < static_cast<int>(plan_.times.size()); ++place) {
      const double wanted = plan_.times[place];
      if (wanted > t + rounding_) break;
      if (wanted >= t - rounding_)
        report_point(client, out_, code_->x(), l, state_, code_->p(), set, place, wanted);
      else
        add_between(client, l, place, wanted);
    }
    set_next_stop(l);
  }
  if (t >= plan_.to) {
    report_point(client, out_, code_->x(), l, state_, code_->p(), set, {}, t);
    Stats stats;
    stats.steps = std::lround(steps);
    stats.rejected = std::lround(at(out_, lane::rejected, l));
    stats.evaluations = 2 + (stats.steps + stats.rejected) * plan_.evaluations_per_step;
    if (wanted_.empty())
      client.finished(set, stats);
    else
      done_.push_back({set, stats});
    free.push_back(l);
  } else if (steps >= plan_.most_steps || !(t > from) ||
             (code_->watches_stiffness() && at(out_, lane::hits, l) >= StepController<double>::enough_hits)) {
    client.abandoned(set);
    free.push_back(l);
  }
}

void Ensemble::end_of(const Numbers& numbers, int l, Point& out) const {
  const auto number = [&](int k) { return numbers[k * W_ + l]; };
  out.t = number(lane::t);
  out.x.resize(n_);
  out.xdot.resize(n_);
  for (int k = 0; k < n_; ++k) {
    out.x[k] = number(code_->x() + k);
    out.xdot[k] = number(code_->xdot() + k);
  }
}

/// Does the client reject the lane's step? state_ is its beginning, out_ its end.
bool Ensemble::is_rejected(EnsembleClient& client, int l) {
  if (!(at(out_, lane::t, l) > at(state_, lane::t, l))) return false;
  end_of(state_, l, step_from_);
  end_of(out_, l, step_to_);
  for (int k = 0; k < p_; ++k) row_[k] = at(state_, code_->p() + k, l);
  return client.rejects(l, set_[l], step_from_, step_to_, row_.data());
}

void Ensemble::run(EnsembleClient& client) {
  ready_set_.assign(static_cast<std::size_t>(W_), no_set);
  next_ready_ = W_;
  exhausted_ = false;
  wanted_.clear();
  done_.clear();
  std::vector<int> free;
  free.reserve(static_cast<std::size_t>(W_));
  for (int l = 0; l < W_; ++l) load(client, l);
  const bool watched = client.watches_steps();
  const double* attention = out_.data() + code_->changing() * W_;
  const auto changing = code_->changing() * W_;
  while (std::any_of(set_.begin(), set_.end(), [](int set) { return set != no_set; })) {
    poll_interrupt();
    code_->step(state_.data(), out_.data(), work_.data());
    for (int l = 0; l < W_; ++l) {
      if (set_[l] == no_set) continue;
      if (watched && is_rejected(client, l)) {
        client.abandoned(set_[l]);
        free.push_back(l);
      } else if (attention[l] != 0) {
        handle_lane(client, l, free);
      }
    }
    std::copy_n(out_.data(), changing, state_.data());
    for (int l : free) load(client, l);
    free.clear();
  }
  flush(client);
}

}  // namespace pendula::integrate
