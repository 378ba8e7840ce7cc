"""The nodes' common host: process, parameters, publishers and subscriptions of the loop."""
