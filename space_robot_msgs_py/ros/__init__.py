"""Common part of all nodes: process, parameters, publishers and subscriptions."""
