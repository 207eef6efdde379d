#include "db/patch_records.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace patchwork {

static_assert(std::endian::native == std::endian::little, "runs are stored as they lie in memory");

namespace {

std::size_t runs_of(std::size_t patches) { return (patches + RecordRun::kRecords - 1) / RecordRun::kRecords; }
std::size_t records_in(std::size_t run, std::size_t patches) {
  return std::min(RecordRun::kRecords, patches - run * RecordRun::kRecords);
}

template <class T>
void append(std::vector<std::byte>& out, const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

bool sound(const PatchRecord& p) {
  const auto is_error = [](double e) { return e >= 0 && std::isfinite(e); };
  return std::all_of(p.error.begin(), p.error.end(), is_error) && is_error(p.bottom) && p.top >= 0;
}

bool sound(const Offer& o, std::size_t run) {
  return o.index / RecordRun::kRecords == run && o.count <= o.cells.size();
}

}  // namespace

std::vector<std::byte> RecordRun::bytes() const {
  std::vector<std::byte> out;
  append(out, records), append(out, offers);
  return out;
}

RecordRun RecordRun::from_bytes(std::span<const std::byte> bytes, std::size_t run, std::size_t patches,
                                std::string& problem) {
  RecordRun r;
  const std::size_t n = records_in(run, patches), head = n * sizeof(PatchRecord);
  if (bytes.size() < head || (bytes.size() - head) % sizeof(Offer)) return problem = "is cut short", r;
  r.records.resize(n), r.offers.resize((bytes.size() - head) / sizeof(Offer));
  std::memcpy(r.records.data(), bytes.data(), head);
  if (!r.offers.empty()) std::memcpy(r.offers.data(), bytes.data() + head, bytes.size() - head);
  if (!std::all_of(r.records.begin(), r.records.end(), [](const PatchRecord& p) { return sound(p); }))
    problem = "holds an error that is none";
  if (!std::all_of(r.offers.begin(), r.offers.end(), [&](const Offer& o) { return sound(o, run); }))
    problem = "holds a cover that is none";
  return r;
}

PatchRecords::PatchRecords(std::size_t size) : size_(size) {
  for (std::size_t run = 0; run < runs_of(size); ++run) {
    auto made = std::make_unique<RecordRun>();
    made->records.resize(records_in(run, size));
    runs_.put(run, std::move(made));
  }
}

PatchRecords::PatchRecords(std::size_t size, Load load)
    : size_(size), runs_(runs_of(size), std::move(load)) {}

const Offer* PatchRecords::offer(std::size_t k) const {
  const std::vector<Offer>& offers = runs_[k / RecordRun::kRecords].offers;
  const auto o = std::lower_bound(offers.begin(), offers.end(), k,
                                  [](const Offer& a, std::size_t index) { return a.index < index; });
  return o != offers.end() && o->index == k ? &*o : nullptr;
}

bool PatchRecords::operator==(const PatchRecords& o) const {
  if (size_ != o.size_) return false;
  for (std::size_t run = 0; run < runs_.size(); ++run)
    if (!(runs_[run] == o.runs_[run])) return false;
  return true;
}

}  // namespace patchwork
