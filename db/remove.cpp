// A grid's way out of the database, in one transaction.
#include "db/database_impl.h"
#include "db/restate.h"
#include "db/stopwatch.h"

namespace patchwork {

RemoveReport Database::remove(const std::string& name) {
  const Stopwatch watch;
  RemoveReport report{.name = name, .extent = {}};
  impl_->change([&] {
    const std::size_t place = impl_->place(name);
    const GridInfo& info = impl_->grids[place].info;
    report.extent = info.bounds();
    Restate restate(*impl_);
    restate.remove(place);
    restate.store("remove " + name);
    const Restate::Effect& e = restate.effect();
    report.patches = e.removed, report.woken = e.woken, report.raised = e.raised;
    return true;
  });
  report.seconds = watch.seconds();
  return report;
}

}  // namespace patchwork
