#include "server/report/pareto.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace strandcast {
namespace {

bool is_usable(const WorkPoint& point) {
  return std::isfinite(point.us) && std::isfinite(point.error) && point.us > 0.0 && point.error >= 0.0;
}

std::string described(const WorkPoint& point) {
  return fmt::format("{} ({:.3g} % at {:.3g} microseconds)", point.label, 100.0 * point.error, point.us);
}

std::vector<WorkPoint> only(const std::vector<WorkPoint>& points, const std::string& method, bool is_same) {
  std::vector<WorkPoint> chosen;
  std::copy_if(points.begin(), points.end(), std::back_inserter(chosen),
               [&](const WorkPoint& point) { return (point.method == method) == is_same; });
  return chosen;
}

}  // namespace

std::vector<size_t> pareto_front(const std::vector<WorkPoint>& points) {
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::erase_if(order, [&](size_t i) { return !is_usable(points[i]); });
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return std::pair(points[a].us, points[a].error) < std::pair(points[b].us, points[b].error);
  });
  std::vector<size_t> front;
  double least = std::numeric_limits<double>::infinity();
  for (const size_t i : order) {
    if (points[i].error >= least) continue;
    least = points[i].error;
    front.push_back(i);
  }
  return front;
}

std::optional<size_t> best_within(const std::vector<WorkPoint>& points, double budget_us) {
  std::optional<size_t> best;
  for (const size_t i : pareto_front(points)) {
    if (points[i].us <= budget_us) best = i;
  }
  return best;
}

std::optional<Beaten> find_beaten(const std::vector<WorkPoint>& points, const std::string& champion,
                                  double error_limit) {
  std::vector<WorkPoint> own = points;
  for (WorkPoint& point : own) {
    if (point.method != champion) point.us = std::numeric_limits<double>::infinity();
  }
  for (const size_t i : pareto_front(own)) {
    if (points[i].error >= error_limit) continue;
    for (size_t j = 0; j < points.size(); ++j) {
      if (points[j].method != champion && is_usable(points[j]) && points[j].us < points[i].us &&
          points[j].error < points[i].error)
        return Beaten{j, i};
    }
  }
  return std::nullopt;
}

std::string beaten_sentence(const std::vector<WorkPoint>& points, const std::string& champion,
                            double error_limit) {
  const std::string limit = fmt::format("{:g} %", 100.0 * error_limit);
  if (const auto beaten = find_beaten(points, champion, error_limit)) {
    return fmt::format("Yes: {} is both more exact and faster than {}.", described(points[beaten->winner]),
                       described(points[beaten->champion]));
  }
  const auto most_exact = [](const std::vector<WorkPoint>& some) -> std::optional<WorkPoint> {
    const std::vector<size_t> front = pareto_front(some);
    return front.empty() ? std::nullopt : std::optional(some[front.back()]);
  };
  const auto own = most_exact(only(points, champion, true));
  if (!own || own->error >= error_limit)
    return fmt::format("{} has no run with an error below {} here, so there is nothing to beat.", champion,
                       limit);
  std::string text = fmt::format(
      "No: for no error below {} is any other model both more exact and faster than {}.", limit, champion);
  if (const auto other = most_exact(only(points, champion, false)))
    text += fmt::format(" The most exact of the others is {}; of {}, {}.", described(*other), champion,
                        described(*own));
  return text;
}

}  // namespace strandcast
