#include "server/input/head_easing.h"

#include <algorithm>
#include <cmath>

#include "common/math/turn.h"

namespace strandcast {
namespace {

// What no eye sees: the head is there, and stays.
constexpr double kUnseenAway = 1e-5, kUnseenAwayPerS = 1e-4;

}  // namespace

/// How far the head goes on after its source fell silent: its speed shrinks evenly.
glm::dvec3 HeadEasing::Part::slowed(double silent_s) const {
  const double slowing_s =
      std::clamp(glm::length(seen_per_s) / easy_per_s2, kShortestEasingS, kLongestSlowingS);
  const double t_s = std::min(silent_s, slowing_s);
  return seen_per_s * t_s * (1.0 - 0.5 * t_s / slowing_s);
}

/// Learns the speed from a way of the source.
void HeadEasing::Part::see(const glm::dvec3& way, double passed_s) {
  const glm::dvec3 change = way / passed_s - seen_per_s;
  const double most = believed_per_s2 * passed_s, size = glm::length(change);
  seen_per_s += size > most ? change * (most / size) : change;
}

/// As a spring does that is damped critically, of a rate w with w^2 away + 2 w away_per_s = easy: that is its
/// greatest acceleration. So the rate grows as the head comes near.
void HeadEasing::Part::approach(double passed_s) {
  const double way = glm::length(away), speed = glm::length(away_per_s);
  if (way < kUnseenAway && speed < kUnseenAwayPerS) {
    away = away_per_s = glm::dvec3(0.0);
    return;
  }
  const double easy_per_s = easy_per_s2 / (speed + std::sqrt(speed * speed + easy_per_s2 * way));
  const double rate_per_s = std::min(kSwiftestPerS, easy_per_s);
  const glm::dvec3 sum_per_s = away_per_s + rate_per_s * away;
  const double decay = std::exp(-rate_per_s * passed_s);
  away = decay * (away + passed_s * sum_per_s);
  away_per_s = decay * (away_per_s - rate_per_s * passed_s * sum_per_s);
}

void HeadEasing::restart(const Pose& seen) {
  *this = {};
  heard_ = reached_ = shown_ = seen;
}

/// The source is taken to have gone evenly from where it was heard of last.
void HeadEasing::hear_again(const Pose& seen, double since_s, double passed_s) {
  place_.seen_per_s = (seen.position_m - heard_.position_m) / since_s;
  turn_.seen_per_s = turn_between(heard_.rotation, seen.rotation) / since_s;
  const Pose before{seen.position_m - passed_s * place_.seen_per_s,
                    turned(seen.rotation, -passed_s * turn_.seen_per_s)};
  place_.away = shown_.position_m - before.position_m;
  turn_.away = turn_between(before.rotation, shown_.rotation);
  time_.seen_per_s.x = 1.0;
  time_.away.x = ahead_s() - (since_s - passed_s);
  for (Part* part : {&place_, &turn_, &time_}) part->away_per_s = part->shown_per_s - part->seen_per_s;
  silent_s_ = 0.0;
}

Pose HeadEasing::follow(const Pose& seen, double since_s, double passed_s) {
  if (silent_s_ > 0.0) {
    hear_again(seen, since_s, passed_s);
  } else if (passed_s > 0.0) {
    place_.see(seen.position_m - heard_.position_m, passed_s);
    turn_.see(turn_between(heard_.rotation, seen.rotation), passed_s);
    time_.seen_per_s.x = since_s / passed_s;
    knows_speed_ = true;
  }
  heard_ = reached_ = seen;
  reached_s_ = 0.0;
  return show(passed_s, since_s);
}

Pose HeadEasing::coast(double passed_s) {
  silent_s_ += passed_s;
  reached_.position_m = heard_.position_m + place_.slowed(silent_s_);
  reached_.rotation = turned(heard_.rotation, turn_.slowed(silent_s_));
  reached_s_ = time_.slowed(silent_s_).x;
  return show(passed_s, 0.0);
}

Pose HeadEasing::hold(double passed_s) {
  if (silent_s_ == 0.0)
    for (Part* part : {&place_, &turn_, &time_}) part->seen_per_s = glm::dvec3(0.0);
  return coast(passed_s);
}

/// `heard_s`: by which the source's time went on since the frame before, as it was heard.
Pose HeadEasing::show(double passed_s, double heard_s) {
  const double before_s = shown_s_;
  for (Part* part : {&place_, &turn_, &time_}) part->approach(passed_s);
  shown_s_ = ahead_s();
  Pose shown = reached_;
  if (place_.away != glm::dvec3(0.0)) shown.position_m += place_.away;
  shown.rotation = turned(shown.rotation, turn_.away);
  if (passed_s > 0.0) {
    place_.shown_per_s = (shown.position_m - shown_.position_m) / passed_s;
    turn_.shown_per_s = turn_between(shown_.rotation, shown.rotation) / passed_s;
    time_.shown_per_s.x = (heard_s + shown_s_ - before_s) / passed_s;
  }
  return shown_ = shown;
}

}  // namespace strandcast
