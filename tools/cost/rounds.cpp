// How often settings are measured, and which of their runs count.
#include "tools/cost/rounds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

namespace patchwork::cli {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kLeastThatCount = 3;
constexpr std::vector<double> Stages::*kStages[] = {&Stages::query,      &Stages::fetch, &Stages::blend,
                                                    &Stages::tessellate, &Stages::draw,  &Stages::light};

std::vector<double> sum(const Stages& ms, std::vector<double> Stages::*without) {
  std::vector<double> all;
  for (const auto stage : kStages) {
    if (stage == without) continue;
    const std::vector<double>& part = ms.*stage;
    all.resize(std::max(all.size(), part.size()));
    for (std::size_t r = 0; r < part.size(); ++r) all[r] += part[r];
  }
  return all;
}

// The runs that count, fastest first.
std::vector<std::size_t> fastest_quarter(const Stages& ms) {
  const std::vector<double> total = ms.total();
  std::vector<std::size_t> runs(total.size());
  std::iota(runs.begin(), runs.end(), std::size_t{0});
  std::stable_sort(runs.begin(), runs.end(),
                   [&](std::size_t a, std::size_t b) { return total[a] < total[b]; });
  runs.resize(std::min(runs.size(), std::max(runs.size() / 4, kLeastThatCount)));
  return runs;
}

bool sure(const Stages& ms) {
  const std::vector<double> total = ms.total();
  const std::vector<std::size_t> runs = fastest_quarter(ms);
  return total[runs.back()] <= (1 + kSure) * total[runs.front()];
}

void keep_fastest_quarter(Stages& ms) {
  const std::vector<std::size_t> runs = fastest_quarter(ms);
  for (const auto stage : kStages) {
    if ((ms.*stage).empty()) continue;
    std::vector<double> kept;
    for (const std::size_t r : runs) kept.push_back((ms.*stage)[r]);
    ms.*stage = std::move(kept);
  }
}

// Whose turn it is, and what came of it.
class Visits {
 public:
  Visits(std::span<const MeasuredRun> all, const Rounds& rounds)
      : all_(all), rounds_(rounds), settings_(all.size()) {
    for (Setting& s : settings_) s.due = uniform();  // before all second visits, in any order
  }

  // False: all has been done.
  bool next() {
    if (left_ == 0 && unsure_ == 0) return false;
    Setting& s = whose_turn();
    if (left_ == 0 && Clock::now() + s.mean() > rounds_.until) return false;
    visit(s);
    return true;
  }
  double share() const {
    const double visits = double(settings_.size()) * rounds_.least;
    return std::min(passed(), 1 - double(left_) / visits);
  }
  std::vector<Stages> take() {
    std::vector<Stages> times;
    for (Setting& s : settings_) keep_fastest_quarter(s.ms), times.push_back(std::move(s.ms));
    return times;
  }

 private:
  struct Setting {
    Stages ms;
    Clock::duration spent{};
    int visits = 0;
    double due = 0;
    bool sure = false;
    Clock::duration mean() const { return spent / std::max(visits, 1); }
  };

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  double passed() const {  // of the time
    return rounds_.until > start_ ? std::min(1., (Clock::now() - start_) * 1. / (rounds_.until - start_)) : 1;
  }

  // Who lacks most of the visits that each must have had by now; if nobody does, who is due first.
  Setting& whose_turn() {
    const auto behind = std::min_element(
        settings_.begin(), settings_.end(),
        [](const auto& a, const auto& b) { return std::pair(a.visits, a.due) < std::pair(b.visits, b.due); });
    if (behind->visits < rounds_.least * passed()) return *behind;
    return *std::min_element(settings_.begin(), settings_.end(),
                             [](const auto& a, const auto& b) { return a.due < b.due; });
  }

  void visit(Setting& s) {
    const auto from = Clock::now();
    all_[std::size_t(&s - settings_.data())](s.ms);
    s.spent += Clock::now() - from;
    left_ -= s.visits++ < rounds_.least;
    unsure_ += s.sure, s.sure = sure(s.ms), unsure_ -= s.sure;
    const std::chrono::duration<double> mean = s.mean();
    s.due = std::max(s.due, 1.) + std::pow(std::max(mean.count(), kLeastSeconds), 0.25) * (0.5 + uniform());
  }

  static constexpr double kLeastSeconds = 1e-4;
  std::span<const MeasuredRun> all_;
  const Rounds& rounds_;
  std::vector<Setting> settings_;
  Clock::time_point start_ = Clock::now();
  std::mt19937_64 random_{1};
  std::size_t left_ = settings_.size() * std::size_t(rounds_.least);  // visits that there must be
  std::size_t unsure_ = settings_.size();
};

}  // namespace

std::vector<double> Stages::total() const { return sum(*this, nullptr); }
std::vector<double> Stages::at_hand() const { return sum(*this, &Stages::fetch); }
void Stages::add(const Stages& runs) {
  for (const auto stage : kStages) {
    const std::vector<double>& more = runs.*stage;
    (this->*stage).insert((this->*stage).end(), more.begin(), more.end());
  }
}

std::vector<Stages> measure(std::span<const MeasuredRun> all, const Rounds& rounds) {
  Visits visits(all, rounds);
  while (visits.next()) rounds.progress(visits.share());
  return visits.take();
}

}  // namespace patchwork::cli
