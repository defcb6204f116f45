"""A property that is computed once for an object, by the first thread that reads it."""

from collections.abc import Callable
from typing import Any, Generic, Self, TypeVar, overload

Value = TypeVar("Value")


class once(Generic[Value]):  # noqa: N801  # a decorator, as functools.cached_property
    """functools.cached_property without the lock that Python 3.11 holds for all objects of a class.

    With that lock, simulations of two threads would wait for each other. Two threads that read the
    property of one object at the same time may both compute it; both get the same value.
    """

    def __init__(self, work: Callable[[Any], Value]) -> None:
        self.work = work
        self.__doc__ = work.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, of: None, owner: type) -> Self: ...
    @overload
    def __get__(self, of: object, owner: type) -> Value: ...
    def __get__(self, of: object | None, owner: type) -> Self | Value:
        if of is None:
            return self
        value = self.work(of)
        of.__dict__[self.name] = value  # has priority over this descriptor from now on
        return value
