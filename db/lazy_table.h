// A numbered table whose slots are read from the store when they are first asked for.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace patchwork {

/// Many threads may read at once, without a lock where the slot is there; who changes the table or drops
/// slots must be alone. Remembers which slots were changed and given up, for whoever stores them.
template <class T>
class LazyTable {
 public:
  /// Makes slot i from what is stored; throws Error where that is missing or damaged. One call at a time.
  using Load = std::function<std::unique_ptr<T>(std::size_t)>;

  LazyTable() = default;
  LazyTable(std::size_t size, Load load) : load_(std::move(load)) { resize(size); }
  LazyTable(LazyTable&& o) noexcept { swap(o); }
  LazyTable& operator=(LazyTable&& o) noexcept {
    swap(o);
    return *this;
  }
  ~LazyTable() {
    for (std::size_t i = 0; i < size_; ++i) delete slots_[i].load(std::memory_order_relaxed);
  }

  std::size_t size() const { return size_; }
  /// REQUIRES: i < size(). CAVEAT: a slot that was never put nor stored must not be read.
  const T& operator[](std::size_t i) const {
    T* const slot = slots_[i].load(std::memory_order_acquire);
    return slot ? *slot : fault(i);
  }
  /// The slot if it is in memory, else nullptr.
  const T* find(std::size_t i) const { return slots_[i].load(std::memory_order_acquire); }
  /// Slots that are in memory.
  std::size_t loaded() const { return loaded_.load(std::memory_order_relaxed); }

  /// The slot, marked as changed.
  T& change(std::size_t i) {
    marks_[i] = kChanged;
    return const_cast<T&>((*this)[i]);
  }
  /// Sets slot i, growing the table up to it.
  void put(std::size_t i, std::unique_ptr<T> value) {
    if (i >= size_) resize(i + 1);
    T* const old = slots_[i].exchange(value.release(), std::memory_order_release);
    if (!old) loaded_.fetch_add(1, std::memory_order_relaxed);
    delete old;
    marks_[i] = kChanged;
  }
  void give_up(std::size_t i) {
    drop(i);
    marks_[i] = kGivenUp;
  }
  /// Lets go of all slots that can be read again.
  void drop_unchanged() {
    for (std::size_t i = 0; load_ && i < size_; ++i)
      if (marks_[i] == 0) drop(i);
  }
  /// Numbers of the slots changed, or given up, since they were taken last; ascending.
  std::vector<std::uint32_t> take_changed() { return take(kChanged); }
  std::vector<std::uint32_t> take_given_up() { return take(kGivenUp); }
  /// This table stands for `o`, which is to be stored over: slots that it does not have are given up.
  void replaces(const LazyTable& o) {
    if (marks_.size() < o.marks_.size()) marks_.resize(o.marks_.size(), kGivenUp);
  }

  /// Calls visit(slot) for all in order; what is not in memory is read and let go again.
  template <class Visit>
  void each(Visit visit) const {
    for (std::size_t i = 0; i < size_; ++i) {
      if (const T* slot = slots_[i].load(std::memory_order_acquire)) {
        visit(*slot);
        continue;
      }
      std::unique_ptr<T> read;
      {
        const std::lock_guard lock(*mutex_);
        read = load_(i);
      }
      visit(*read);
    }
  }

 private:
  enum Mark : std::uint8_t { kChanged = 1, kGivenUp = 2 };
  using Slot = std::atomic<T*>;

  const T& fault(std::size_t i) const {
    const std::lock_guard lock(*mutex_);
    if (T* const slot = slots_[i].load(std::memory_order_acquire)) return *slot;
    T* const made = load_(i).release();
    slots_[i].store(made, std::memory_order_release);
    loaded_.fetch_add(1, std::memory_order_relaxed);
    return *made;
  }
  void drop(std::size_t i) {
    T* const slot = slots_[i].exchange(nullptr, std::memory_order_relaxed);
    if (slot) loaded_.fetch_sub(1, std::memory_order_relaxed);
    delete slot;
  }
  void resize(std::size_t size) {
    if (size > room_) {
      const std::size_t room = std::max(size, room_ + room_ / 2);
      auto slots = std::make_unique<Slot[]>(room);
      for (std::size_t i = 0; i < size_; ++i)
        slots[i].store(slots_[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
      slots_ = std::move(slots), room_ = room;
    }
    size_ = size;
    if (marks_.size() < size) marks_.resize(size);
  }
  std::vector<std::uint32_t> take(Mark mark) {
    std::vector<std::uint32_t> taken;
    for (std::size_t i = 0; i < marks_.size(); ++i)
      if (marks_[i] == mark) taken.push_back(std::uint32_t(i)), marks_[i] = 0;
    return taken;
  }
  void swap(LazyTable& o) noexcept {
    std::swap(load_, o.load_), std::swap(mutex_, o.mutex_), std::swap(slots_, o.slots_);
    std::swap(size_, o.size_), std::swap(room_, o.room_), std::swap(marks_, o.marks_);
    loaded_.store(o.loaded_.exchange(loaded_.load()));
  }

  Load load_;
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // on the heap: tables can be moved
  std::unique_ptr<Slot[]> slots_;
  std::size_t size_ = 0, room_ = 0;
  mutable std::atomic<std::size_t> loaded_{0};
  std::vector<std::uint8_t> marks_;  // a Mark or 0; more than slots where the end was given up
};

}  // namespace patchwork
