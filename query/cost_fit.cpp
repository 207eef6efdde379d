// Cost models fitted to what was measured, and kept in the database.
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "query/cost_model.h"

namespace patchwork {

namespace {

constexpr const char* kName = "cost model";

// Under these names the costs are kept.
struct Entry {
  const char* name;
  double CostModel::*cost;
};
constexpr Entry kEntries[] = {{"fixed", &CostModel::fixed},
                              {"page", &CostModel::page},
                              {"patch", &CostModel::patch},
                              {"beyond", &CostModel::beyond},
                              {"read_fixed", &CostModel::read_fixed},
                              {"read_patch", &CostModel::read_patch},
                              {"blend_fixed", &CostModel::blend_fixed},
                              {"blend_patch", &CostModel::blend_patch},
                              {"sample", &CostModel::sample},
                              {"edge", &CostModel::edge}};

constexpr int kCounts = 4;

// What one part of an answer depends on, and what it took.
struct Observation {
  std::array<double, kCounts> counts;
  double seconds;
};

// Costs that would be below zero are left out, the worst one first.
std::array<double, kCounts> solve(const std::vector<Observation>& all) {
  std::array<double, kCounts> x{};
  if (all.empty()) return x;
  Eigen::MatrixXd a(Eigen::Index(all.size()), kCounts);
  for (Eigen::Index r = 0; r < a.rows(); ++r)
    for (Eigen::Index k = 0; k < kCounts; ++k)
      a(r, k) = all[std::size_t(r)].counts[std::size_t(k)] / all[std::size_t(r)].seconds;
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(a.rows());
  for (int left = kCounts; left > 0; --left) {
    const Eigen::Vector4d found = a.completeOrthogonalDecomposition().solve(ones);
    Eigen::Index worst;
    if (found.minCoeff(&worst) >= 0) return {found[0], found[1], found[2], found[3]};
    a.col(worst).setZero();
  }
  return x;
}

}  // namespace

CostModel fit(std::span<const Measured> answers) {
  std::vector<Observation> find, read, blend;
  for (const Measured& m : answers) {
    if (m.find > 0)
      find.push_back({{1, m.pages, m.patches, std::max(0.0, m.patches - CostModel::kCached)}, m.find});
    if (m.read > 0) read.push_back({{1, 0, m.patches, 0}, m.read});
    if (m.blend > 0) blend.push_back({{1, m.samples, m.patches, std::sqrt(m.patches * m.samples)}, m.blend});
  }
  const auto f = solve(find), r = solve(read), b = solve(blend);
  return {.fixed = f[0],
          .page = f[1],
          .patch = f[2],
          .beyond = f[3],
          .read_fixed = r[0],
          .read_patch = r[2],
          .blend_fixed = b[0],
          .blend_patch = b[2],
          .sample = b[1],
          .edge = b[3]};
}

std::string machine_name() {
  std::ifstream info("/proc/cpuinfo");
  std::string name = "unknown processor";
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
      name = line.substr(line.find(": ") + 2);
      break;
    }
  return name + " x " + std::to_string(std::thread::hardware_concurrency());
}

std::optional<CostModel> saved_model(const Database& db) {
  const auto kept = nlohmann::json::parse(db.remark(kName).value_or(""), nullptr, false);
  if (!kept.is_object() || kept.value("machine", nlohmann::json()) != machine_name()) return {};
  CostModel model;
  for (const Entry& e : kEntries) {
    const auto cost = kept.find(e.name);
    if (cost == kept.end() || !cost->is_number()) return {};
    model.*e.cost = *cost;
    if (!std::isfinite(model.*e.cost) || model.*e.cost < 0) return {};
  }
  return model;
}

void save_model(Database& db, const CostModel& model) {
  nlohmann::json kept{{"machine", machine_name()}};
  for (const Entry& e : kEntries) kept[e.name] = model.*e.cost;
  db.keep_remark(kName, kept.dump());
}

CostModel model_of(const Database& db) {
  const std::optional<CostModel> saved = saved_model(db);
  return saved ? *saved : calibrate(db);
}

}  // namespace patchwork
