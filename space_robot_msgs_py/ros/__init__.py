"""The nodes' common shell: process, parameters, publishers and subscriptions of the loop."""
