// Files of strandcast-report collisions: CSV tables, plots and one page. Pure functions of a CollisionStudy,
// except saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/collision_study.h"

namespace strandcast {

inline constexpr const char* kCollisionPage = "collisions.html";

/// Returns a recommendation in some sentences.
std::string collision_summary(const CollisionStudy& study);

std::string head_collision_csv(const CollisionStudy& study);
std::string body_answer_csv(const CollisionStudy& study);
/// Returns a plot of penetration into the head against the time of a step.
std::string head_collision_plot(const CollisionStudy& study);
/// Returns a plot of penetration into the body against the time of a step.
std::string body_answer_plot(const CollisionStudy& study);
std::string collision_page(const CollisionStudy& study);

Status save_collision_study(const CollisionStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
