// The files of strandcast-report collisions: tables as CSV, plots, and one page. Pure functions of a
// CollisionStudy but for saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/collision_study.h"

namespace strandcast {

inline constexpr const char* kCollisionPage = "collisions.html";

/// What to pick, in some sentences.
std::string collision_summary(const CollisionStudy& study);

std::string head_collision_csv(const CollisionStudy& study);
std::string body_answer_csv(const CollisionStudy& study);
/// How deep hair gets in the head against the time of a step.
std::string head_collision_plot(const CollisionStudy& study);
/// Likewise in the body.
std::string body_answer_plot(const CollisionStudy& study);
std::string collision_page(const CollisionStudy& study);

Status save_collision_study(const CollisionStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
