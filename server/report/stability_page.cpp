#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "server/report/html_page.h"
#include "server/report/report_files.h"
#include "server/report/stability.h"

namespace strandcast {
namespace {

constexpr StabilityMeasure kMeasures[kStabilityMeasureCount] = {
    StabilityMeasure::Finite, StabilityMeasure::Stretch, StabilityMeasure::Speed, StabilityMeasure::Energy,
    StabilityMeasure::Rest,   StabilityMeasure::Jitter,  StabilityMeasure::Style};

// Column heads, with the unit of the numbers below.
const char* head_of(StabilityMeasure measure) {
  constexpr const char* kHeads[kStabilityMeasureCount] = {"broken", "stretch",     "speed m/s",  "energy",
                                                          "rest s", "jitter m/s2", "off style m"};
  return kHeads[static_cast<size_t>(measure)];
}

std::string shown(StabilityMeasure measure, double value) {
  if (std::isinf(value)) return measure == StabilityMeasure::Rest ? "not yet" : "inf";
  if (measure == StabilityMeasure::Finite) return fmt::format("{:.0f}", value);
  if (measure == StabilityMeasure::Speed || measure == StabilityMeasure::Rest)
    return fmt::format("{:.1f}", value);
  return value == 0.0 ? "0" : fmt::format("{:.1e}", value);
}

struct Count {
  int judged = 0;
  int kept = 0;
  int refused = 0;
};

void count(const StabilityOutcome& outcome, Count& total) {
  if (!outcome.refusal.empty()) ++total.refused;
  for (const auto& cell : outcome.cells) {
    if (!cell || !cell->promise.is_promised) continue;
    ++total.judged;
    total.kept += cell->is_kept() ? 1 : 0;
  }
}

/// Names in the order in which they first appear.
std::vector<std::string> names(const std::vector<StabilityOutcome>& outcomes,
                               std::string StabilityOutcome::*name) {
  std::vector<std::string> found;
  for (const StabilityOutcome& outcome : outcomes)
    if (std::find(found.begin(), found.end(), outcome.*name) == found.end()) found.push_back(outcome.*name);
  return found;
}

std::string in_words(const Count& total) {
  std::string text = total.judged > 0 ? fmt::format("{} of {}", total.kept, total.judged) : "";
  if (total.refused > 0) text += fmt::format("{}{} refused", text.empty() ? "" : ", ", total.refused);
  return text;
}

std::string sentence(const Count& total) {
  std::string text = fmt::format("{} of {} promises kept", total.kept, total.judged);
  if (total.refused > 0) text += fmt::format(", {} trials refused as the server would", total.refused);
  return text + ".";
}

HtmlTable overview(const std::vector<StabilityOutcome>& outcomes) {
  HtmlTable table;
  table.caption = "Promises kept, by kind of trial. A refused trial is one that the server does not load.";
  table.columns = {"model"};
  const std::vector<std::string> groups = names(outcomes, &StabilityOutcome::group);
  table.columns.insert(table.columns.end(), groups.begin(), groups.end());
  table.columns.push_back("all");
  for (const std::string& row : names(outcomes, &StabilityOutcome::row)) {
    std::vector<HtmlCell> cells = {row};
    std::map<std::string, Count> by_group;
    Count all;
    for (const StabilityOutcome& outcome : outcomes) {
      if (outcome.row != row) continue;
      count(outcome, by_group[outcome.group]);
      count(outcome, all);
    }
    const auto cell = [](const Count& total) {
      if (total.judged + total.refused == 0) return HtmlCell("");
      const bool is_kept = total.kept == total.judged;
      return HtmlCell(in_words(total), is_kept ? HtmlMark::Good : HtmlMark::Bad);
    };
    for (const std::string& group : groups) cells.push_back(cell(by_group[group]));
    cells.push_back(cell(all));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

HtmlTable table_of(const std::vector<StabilityOutcome>& outcomes, const std::string& row) {
  HtmlTable table;
  table.columns = {"trial"};
  for (const StabilityMeasure measure : kMeasures) table.columns.emplace_back(head_of(measure));
  for (const StabilityOutcome& outcome : outcomes) {
    if (outcome.row != row) continue;
    std::vector<HtmlCell> cells = {outcome.group + ": " + outcome.setting};
    for (const StabilityMeasure measure : kMeasures) {
      const auto& cell = outcome.cells[static_cast<size_t>(measure)];
      if (!outcome.refusal.empty()) {
        cells.emplace_back(measure == StabilityMeasure::Finite ? "refused" : "");
      } else if (!cell) {
        cells.emplace_back("");
      } else {
        const HtmlMark mark = !cell->promise.is_promised ? HtmlMark::None
                              : cell->is_kept()          ? HtmlMark::Good
                                                         : HtmlMark::Bad;
        std::string text = shown(measure, cell->value);
        if (mark == HtmlMark::Bad) text += fmt::format(" > {}", shown(measure, cell->promise.limit));
        cells.emplace_back(std::move(text), mark);
      }
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

/// What the numbers of a row need said: changed parameters, refusals, reasons for red cells.
std::vector<std::string> remarks(const std::vector<StabilityOutcome>& outcomes, const std::string& row) {
  std::vector<std::string> lines;
  std::vector<std::pair<std::string, std::string>> red;  // reason, and the trials it is given for
  for (const StabilityOutcome& outcome : outcomes) {
    if (outcome.row != row) continue;
    const std::string trial = outcome.group + " " + outcome.setting;
    if (!outcome.note.empty()) lines.push_back(fmt::format("{}: {}.", trial, outcome.note));
    if (!outcome.refusal.empty()) lines.push_back(fmt::format("Refused, {}: {}", trial, outcome.refusal));
    for (const auto& cell : outcome.cells) {
      if (!cell || cell->is_kept() || cell->known_break == nullptr) continue;
      const std::string reason =
          fmt::format("{}: {}.", name_of(cell->known_break->measure), cell->known_break->reason);
      const auto known =
          std::find_if(red.begin(), red.end(), [&](const auto& entry) { return entry.first == reason; });
      if (known == red.end()) {
        red.emplace_back(reason, trial);
      } else {
        known->second += "; " + trial;
      }
    }
  }
  for (const auto& [reason, trials] : red) lines.push_back(fmt::format("Red, {}, {}", trials, reason));
  return lines;
}

}  // namespace

std::string stability_csv(const std::vector<StabilityOutcome>& outcomes) {
  CsvFile csv({"solver", "group", "setting", "measure", "value", "limit", "kept", "known_break", "parameters",
               "refusal"});
  for (const StabilityOutcome& outcome : outcomes) {
    if (!outcome.refusal.empty())
      csv.add_row({outcome.row, outcome.group, outcome.setting, "", "", "", "refused", "", outcome.note,
                   outcome.refusal});
    for (const StabilityMeasure measure : kMeasures) {
      const auto& cell = outcome.cells[static_cast<size_t>(measure)];
      if (!cell) continue;
      const bool is_promised = cell->promise.is_promised;
      csv.add_row({outcome.row, outcome.group, outcome.setting, name_of(measure), csv_number(cell->value),
                   is_promised ? csv_number(cell->promise.limit) : "",
                   !is_promised      ? "not promised"
                   : cell->is_kept() ? "yes"
                                     : "no",
                   cell->known_break != nullptr && !cell->is_kept() ? cell->known_break->reason : "",
                   outcome.note, ""});
    }
  }
  return csv.text();
}

std::string stability_text(const std::vector<StabilityOutcome>& outcomes) {
  std::string text;
  for (const std::string& row : names(outcomes, &StabilityOutcome::row)) {
    text += fmt::format("\n{:<44}", row);
    for (const StabilityMeasure measure : kMeasures) text += fmt::format("{:>15}", head_of(measure));
    text += "\n";
    for (const StabilityOutcome& outcome : outcomes) {
      if (outcome.row != row) continue;
      text += fmt::format("  {:<9} {:<32}", outcome.group, outcome.setting);
      if (!outcome.refusal.empty()) {
        text += fmt::format("  refused: {}\n", outcome.refusal);
        continue;
      }
      for (const StabilityMeasure measure : kMeasures) {
        const auto& cell = outcome.cells[static_cast<size_t>(measure)];
        const std::string value = cell ? shown(measure, cell->value) : "";
        text += fmt::format("{:>14}{}", value, cell && !cell->is_kept() ? "!" : " ");
      }
      text += "\n";
    }
    for (const std::string& line : remarks(outcomes, row)) text += "  " + line + "\n";
  }
  Count all;
  for (const StabilityOutcome& outcome : outcomes) count(outcome, all);
  text += fmt::format("\n{} '!' marks the others.\n", sentence(all));
  return text;
}

std::string stability_page(const std::vector<StabilityOutcome>& outcomes, const StabilitySetup& setup) {
  HtmlPage page("Stability of the strand models");
  Count all;
  for (const StabilityOutcome& outcome : outcomes) count(outcome, all);
  page.answer(
      fmt::format("{} A red cell is a promise that does not hold, with the number that was "
                  "measured and the limit; below each table is why, where it is known.",
                  sentence(all)));
  const RestLengths lengths = rest_lengths(setup.grid);
  page.paragraph(fmt::format(
      "Seven strands of 0.25 m and 16 vertices on a head, parameters at their defaults unless a setting says "
      "otherwise, 60 steps per second, no substeps, no colliders. Run on {}, in single precision; models "
      "without a kernel in double precision on one core.",
      setup.device));
  page.paragraph(fmt::format(
      "Hair at rest stands still for {:g} s; many steps are {}.{}", lengths.rest_s, lengths.many_steps,
      setup.grid == StabilityGrid::Full
          ? ""
          : " This is the quick report: the full one has every decade of stiffness, ten "
            "minutes at rest and a million steps."));
  page.table(overview(outcomes));
  page.heading("What is promised");
  for (const StabilityMeasure measure : kMeasures)
    page.paragraph(fmt::format("{}: {}", head_of(measure), promise_reason(measure)));
  for (const std::string& row : names(outcomes, &StabilityOutcome::row)) {
    page.heading(row);
    page.table(table_of(outcomes, row));
    for (const std::string& line : remarks(outcomes, row)) page.paragraph(line);
  }
  return page.text();
}

}  // namespace strandcast
